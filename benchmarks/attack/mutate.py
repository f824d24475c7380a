"""How files are damaged: as disks and programs do it (bytes, lines), and as people do it (a digit, a sign, a cell)."""

from __future__ import annotations

import random
import re
from collections.abc import Callable

NUMBER = re.compile(rb"[-+]?[0-9]+(?:\.[0-9]+)?(?:[eE][-+]?[0-9]+)?")
TOKENS = (
    b"nan", b"inf", b"-inf", b"1e308", b"1e999", b"-0", b"1e-320", b"9" * 400, b"9" * 5000, b"\x00", b"\x1b[2J", b"\r",
    b"\xff\xfe", "٣".encode(), "−5".encode(), b"1_000", b"0x10", b'"', b"'", b"[" * 3000, b"{", b"]", b"=", b";", b"\t",
    b"," * 50, b"#", b"true", b"null", b"1,234", b" " * 20000, b"\n" * 5000, b"A" * 140000, b"{{ 7 }}", b"<!DOCTYPE a>",
    b"../../etc/passwd", b"1e5", b"-1", b"0", b"2", b"1000000000000",
)  # fmt: skip
Change = Callable[[bytes, random.Random], bytes]


def flip(data: bytes, pick: random.Random) -> bytes:
    """Some bits are wrong."""
    out = bytearray(data)
    for _ in range(pick.choice((1, 1, 2, 8))):
        if out:
            out[pick.randrange(len(out))] ^= 1 << pick.randrange(8)
    return bytes(out)


def cut(data: bytes, pick: random.Random) -> bytes:
    """The end is missing, or a piece in the middle."""
    a, b = sorted((pick.randrange(len(data) + 1), pick.randrange(len(data) + 1)))
    return data[:a] if pick.random() < 0.5 else data[:a] + data[b:]


def insert(data: bytes, pick: random.Random) -> bytes:
    """Something is there that does not belong."""
    at = pick.randrange(len(data) + 1)
    return data[:at] + pick.choice(TOKENS) + data[at:]


def swap_number(data: bytes, pick: random.Random) -> bytes:
    """In place of a number stands something else."""
    found = list(NUMBER.finditer(data))
    if not found:
        return insert(data, pick)
    one = pick.choice(found)
    return data[: one.start()] + pick.choice(TOKENS) + data[one.end() :]


def lines(data: bytes, pick: random.Random) -> bytes:
    """Lines are doubled, gone, exchanged, or a block of them is repeated."""
    rows = data.split(b"\n")
    a, b = sorted((pick.randrange(len(rows)), pick.randrange(len(rows))))
    kind = pick.randrange(4)
    if kind == 0:
        rows.insert(a, rows[b])
    elif kind == 1:
        del rows[a]
    elif kind == 2:
        rows[a], rows[b] = rows[b], rows[a]
    else:
        rows[b:b] = rows[a:b]
    return b"\n".join(rows)


def separators(data: bytes, pick: random.Random) -> bytes:
    """Another delimiter, decimal mark or end of line."""
    old, new = pick.choice(((b",", b";"), (b".", b","), (b"\n", b"\r\n"), (b",", b"\t"), (b"=", b":"), (b"\n", b"\r")))
    return data.replace(old, new)


def splice(data: bytes, pick: random.Random) -> bytes:
    """A piece of the file stands somewhere else in it."""
    a, b = sorted((pick.randrange(len(data) + 1), pick.randrange(len(data) + 1)))
    at = pick.randrange(len(data) + 1)
    return data[:at] + data[a : min(b, a + 2000)] + data[at:]


def encode(data: bytes, pick: random.Random) -> bytes:
    """Another encoding."""
    text = data.decode("utf-8", "replace")
    return text.encode(pick.choice(("utf-16", "utf-8-sig", "utf-16-le", "utf-32")))


WILD: tuple[Change, ...] = (flip, cut, insert, swap_number, lines, separators, splice, encode)


def wild(data: bytes, pick: random.Random) -> bytes:
    """One to three damages of any kind."""
    for _ in range(pick.choice((1, 1, 1, 2, 3))):
        data = pick.choice(WILD)(data, pick)
    return data


def slip(data: bytes, pick: random.Random) -> bytes:
    """A slip of the pen in one number: a digit wrong, gone, doubled or exchanged, the point or the sign elsewhere."""
    found = [one for one in NUMBER.finditer(data) if not _in_comment(data, one.start())]
    one = pick.choice(found)
    text = one.group().decode()
    digits = [i for i, c in enumerate(text) if c.isdigit()]
    i, kind = pick.choice(digits), pick.randrange(7)
    if kind == 0:
        new = text[:i] + pick.choice([d for d in "0123456789" if d != text[i]]) + text[i + 1 :]
    elif kind == 1:
        new = text[:i] + text[i + 1 :] or "0"
    elif kind == 2:
        new = text[:i] + text[i] + text[i:]
    elif kind == 3 and i + 1 < len(text) and text[i + 1].isdigit():
        new = text[:i] + text[i + 1] + text[i] + text[i + 2 :]
    elif kind == 4 and "." in text:
        bare = text.replace(".", "")
        at = pick.randrange(1, len(bare) + 1)
        new = bare[:at] + "." + (bare[at:] or "0")
    elif kind == 5:
        new = text[1:] if text[0] in "+-" else "-" + text
    else:
        new = f"{float(text) * pick.choice((1e3, 1e-3, 25.4, 1 / 25.4, 10.0, 0.1)):.7g}"
    return data[: one.start()] + new.encode() + data[one.end() :]


def _in_comment(data: bytes, at: int) -> bool:
    return data[data.rfind(b"\n", 0, at) + 1 : at].lstrip().startswith(b"#")
