"""flipflow.report"""
