"""Frame batches, the Lightning module, and the network behind the model interface. Knows nothing of rendering."""

from dnnvss.training.blend import BlendedNetworks
from dnnvss.training.guided import GuidedCodebook
from dnnvss.training.network import NetworkModel
from dnnvss.training.settings import FitSettings

__all__ = ["BlendedNetworks", "FitSettings", "GuidedCodebook", "NetworkModel"]
