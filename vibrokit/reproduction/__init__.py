"""The paper reproduced: its scenes by three methods, its figures, and a verdict on each published number."""
