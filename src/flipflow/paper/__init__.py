"""The paper, reproduced: one file a figure with its claims; each claim is decided by numbers."""
