"""flipflow.methods"""
