"""The engine that fits networks: batches, module, kernels, checkpoints. Knows nothing of rendering."""

from dnnvss.training.settings import FitSettings

__all__ = ["FitSettings"]
