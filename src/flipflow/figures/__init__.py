"""flipflow.figures"""
