"""flipflow.results"""
