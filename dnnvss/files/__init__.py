"""Files: read or refused, written whole or not at all, and named inside their folder."""

from dnnvss.files.mapping import forget, mapped, shared
from dnnvss.files.names import check_apart, check_name, inside
from dnnvss.files.reading import digest, read, read_json, read_text, text_encoding
from dnnvss.files.whole import check_writable, locked, make_folder, remedy_for, remove, replacing, together
from dnnvss.files.writing import Rows, as_utf8, json_text, printable, write_arrays, write_json, write_text

__all__ = [
    "Rows",
    "as_utf8",
    "check_apart",
    "check_name",
    "check_writable",
    "digest",
    "forget",
    "inside",
    "json_text",
    "locked",
    "make_folder",
    "mapped",
    "printable",
    "read",
    "read_json",
    "read_text",
    "remedy_for",
    "remove",
    "replacing",
    "shared",
    "text_encoding",
    "together",
    "write_arrays",
    "write_json",
    "write_text",
]
