"""Adapters between evalbus and other evaluation and training programs. Each module imports the program it is for."""
