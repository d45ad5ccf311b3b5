"""flipflow.kernels"""
