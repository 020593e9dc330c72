"""Networks for other programs (ONNX, torch.export), with all that their numbers mean inside the file; and curves."""
