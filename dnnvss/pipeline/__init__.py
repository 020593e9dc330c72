"""Where the commands were; ``dnnvss --help`` lists them now."""
