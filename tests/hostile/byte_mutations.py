"""Mutations of a URDF as a file: its bytes, its encoding, its entities."""

from random import Random

from tests.hostile.mutation_values import OTHERS


def cut(document: bytes, rng: Random) -> bytes:
    """The document up to a random byte."""
    return document[: rng.randrange(len(document) + 1)]


def flipped(document: bytes, rng: Random) -> bytes:
    """The document with a few bytes changed."""
    spoilt = bytearray(document)
    for _ in range(rng.choice((1, 3, 20))):
        spoilt[rng.randrange(len(spoilt))] = rng.randrange(256)
    return bytes(spoilt)


def spliced(document: bytes, rng: Random) -> bytes:
    """The document with a piece of it repeated or left out, or bytes of another kind within it."""
    start, end = sorted(rng.randrange(len(document) + 1) for _ in range(2))
    middle = rng.choice(
        (b"", document[start:end] * 2, b"\x00", b"\xff\xfe", b"\x1b[31m", b"<!-- -- -->", b"]]>", b"&x;")
    )
    return document[:start] + middle + document[end:]


def encoded(document: bytes, rng: Random) -> bytes:
    """The document in another encoding, rightly or wrongly declared."""
    text = document.decode("utf-8").partition("?>")[2].replace("cover", "Türgriff 把手")
    said, used = (rng.choice(("utf-8", "utf-16", "latin-1", "ascii", "utf-32", "cp1252", "gbk")) for _ in range(2))
    declared = rng.choice(
        (f"<?xml version='1.0' encoding='{said}'?>", "<?xml version='1.0' encoding='none'?>", "", "\ufeff")
    )
    return (declared + text).encode(used, errors="replace")


def bombed(document: bytes, rng: Random) -> bytes:
    """Entities that grow, that read files, and that mean themselves."""
    body = document.partition(b"?>")[2]
    grown = "".join(f'<!ENTITY a{n} "{f"&a{n - 1};" * 10}">' for n in range(1, rng.choice((3, 9, 30))))
    kinds = (
        f'<!ENTITY a0 "{"x" * 10}">{grown}', '<!ENTITY a8 "&a8;">', '<!ENTITY a8 SYSTEM "file:///etc/passwd">',
        '<!ENTITY a8 SYSTEM "../outside/secret.obj">', '<!ENTITY % p SYSTEM "http://127.0.0.1:9/x">%p;',
        '<!ENTITY a8 SYSTEM "file:///dev/zero">',
    )  # fmt: skip
    head = f"<?xml version='1.0'?><!DOCTYPE robot [{rng.choice(kinds)}]>".encode()
    start = body.find(b">", body.find(b"<robot")) + 1
    used = rng.choice((b"&a8;", b"<link name='&a8;'/>", b"&a2;"))
    return head + body[:start] + used + body[start:]


def replaced(document: bytes, rng: Random) -> bytes:
    """Something else altogether in the place of the document."""
    return rng.choice(OTHERS)
