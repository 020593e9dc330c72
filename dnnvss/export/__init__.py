"""Networks for other programs: ONNX and torch.export, with everything that their numbers mean inside the file."""
