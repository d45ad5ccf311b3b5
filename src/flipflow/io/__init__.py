"""flipflow.io"""
