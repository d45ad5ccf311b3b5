"""flipflow.analyses"""
