"""``python -m dnnvss.studio``: the same as ``dnnvss studio``."""

import runpy
import sys

if __name__ == "__main__":
    sys.argv[1:1] = ["studio"]
    runpy.run_module("dnnvss", run_name="__main__", alter_sys=True)
