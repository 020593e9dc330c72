"""Which number format a fit uses."""

import platform

import torch

from dnnvss.errors import DnnvssError


def has_bf16(device: str = "cpu") -> bool:
    """Return whether the device (``cpu``, ``cuda``) multiplies bf16 matrices in hardware.

    On a processor without it torch has no good kernel: 6 to 200 times as slow as float32 (measured, AVX2).
    """
    if device == "cpu":
        native = platform.machine() not in ("x86_64", "AMD64") or (  # others with AVX-512 are supported and no faster
            torch.cpu._is_avx512_bf16_supported() or torch.cpu._is_amx_tile_supported())
        return native and bool(torch.ops.mkldnn._is_mkldnn_bf16_supported())
    return torch.cuda.is_bf16_supported(including_emulation=False)


def resolve(precision: str, accelerator: str = "auto") -> str:
    """Return ``32-true`` or ``bf16-mixed``; ``auto`` takes bf16 where the device has it.

    Args:
        precision: ``32-true``, ``bf16-mixed`` or ``auto``.
        accelerator: as Lightning takes it.

    Raises:
        DnnvssError: bf16 on a device that does not have it.
    """
    device = "cuda" if accelerator in ("auto", "gpu", "cuda") and torch.cuda.is_available() else "cpu"
    if precision == "auto":
        return "bf16-mixed" if has_bf16(device) else "32-true"
    if precision == "bf16-mixed" and not has_bf16(device):
        raise DnnvssError(f"trainer.precision=bf16-mixed on a device ({device}) that has no bf16 products",
                          remedy="Use trainer.precision=auto or 32-true")
    return precision
