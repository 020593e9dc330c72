"""Raw recordings to a prepared corpus; a file per corpus. Run as ``python -m data_prep corpus=NAME``."""
