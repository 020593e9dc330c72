"""Frame batches, the Lightning module, and the network behind the model interface. Knows nothing of rendering."""

from dnnvss.training.network import NetworkModel
from dnnvss.training.settings import FitSettings

__all__ = ["FitSettings", "NetworkModel"]
