"""pushplan: planning and optimization baselines for robots that push things."""

__version__ = "0.3.0"
