"""flipflow.cli"""
