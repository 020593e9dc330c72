"""The command has a name of its own: ``dnnvss viewing``."""

from dnnvss.moved import moved

if __name__ == "__main__":
    moved("dnnvss.evaluation.viewing", "viewing")
