"""The process in which eSpeak NG speaks: a request as JSON comes in, phoneme events as JSON go out.

Run by :mod:`dnnvss.speech.engines.espeak` as a file; it imports nothing of the package.
"""

import ctypes
import json
import sys
import wave
from pathlib import Path

_SYNCHRONOUS, _PHONEME_EVENTS, _DONT_EXIT = 2, 0x1, 0x8000
_UTF8, _PHONEMES, _BY_CHARACTER = 0x1, 0x100, 1
_EVENT_PHONEME, _EVENT_END_OF_LIST = 7, 0
_LONGEST_PATH = 120  # the library keeps its data path in 160 bytes


class _Id(ctypes.Union):
    _fields_ = (("number", ctypes.c_int), ("name", ctypes.c_char_p), ("string", ctypes.c_char * 8))


class _Event(ctypes.Structure):
    _fields_ = (
        ("type", ctypes.c_int), ("identifier", ctypes.c_uint), ("text_position", ctypes.c_int),
        ("length", ctypes.c_int), ("audio_position", ctypes.c_int), ("sample", ctypes.c_int),
        ("user_data", ctypes.c_void_p), ("id", _Id),
    )


_CALLBACK = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.POINTER(ctypes.c_short), ctypes.c_int, ctypes.POINTER(_Event))


def speak(library: str, data: str, text: str, voice: str) -> tuple[bytes, int, list[tuple[str, int]]]:
    """Return 16-bit samples as bytes, their rate, and the phonemes with the sample at which each begins.

    Raises:
        RuntimeError: the library refuses the data, the voice or the text.
    """
    lib = ctypes.CDLL(library)
    rate = lib.espeak_Initialize(_SYNCHRONOUS, 500, data.encode(), _PHONEME_EVENTS | _DONT_EXIT)
    if rate <= 0:
        raise RuntimeError(f"eSpeak NG cannot read its data in {data}")
    blocks: list[bytes] = []
    events: list[tuple[str, int]] = []

    def receive(samples: "ctypes._Pointer[ctypes.c_short]", count: int, happened: "ctypes._Pointer[_Event]") -> int:
        index = 0
        while happened[index].type != _EVENT_END_OF_LIST:
            if happened[index].type == _EVENT_PHONEME:
                events.append((happened[index].id.string.decode("utf-8", "replace"), happened[index].sample))
            index += 1
        if samples and count:
            blocks.append(ctypes.string_at(samples, 2 * count))
        return 0

    callback = _CALLBACK(receive)
    lib.espeak_SetSynthCallback(callback)
    spoken = text.encode() + b"\0"
    if lib.espeak_SetVoiceByName(voice.encode()) or lib.espeak_Synth(
            spoken, len(spoken), 0, _BY_CHARACTER, 0, _UTF8 | _PHONEMES, None, None) or lib.espeak_Synchronize():
        raise RuntimeError(f"eSpeak NG cannot speak with the voice {voice}")
    return b"".join(blocks), rate, events


def main() -> None:
    """Answer the one request on standard input: write the wav that it names, print the events.

    The folder of the wav is for this request alone.
    """
    import espeakng_loader  # only this process may load it

    request = json.load(sys.stdin)
    folder = Path(espeakng_loader.get_data_path()).parent
    if len(str(folder)) > _LONGEST_PATH:
        link = Path(request["wav"]).with_name("e")
        link.symlink_to(folder, target_is_directory=True)
        folder = link
    library = espeakng_loader.get_library_path()
    samples, rate, events = speak(library, str(folder), request["text"], request["voice"])
    with wave.open(request["wav"], "wb") as out:
        out.setnchannels(1)
        out.setsampwidth(2)
        out.setframerate(rate)
        out.writeframes(samples)
    json.dump(events, sys.stdout)


if __name__ == "__main__":
    main()
