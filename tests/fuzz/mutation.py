"""Spoils files: bits, lengths, counts, ends, words and trees; the same seed spoils alike."""

from __future__ import annotations

from random import Random
import re
from struct import pack_into

LENGTHS = (0, 1, 2, 7, 8, 255, 256, 65535, 65536, 2**24, 2**31 - 1, 2**31, 2**32 - 1, 2**40,
           2**63 - 1, 2**63, 2**64 - 1)
WORDS = (
    b'', b'nan', b'.nan', b'inf', b'-.inf', b'1e400', b'-0.0', b'5e-324', b'9' * 400,
    b'0x7fffffff', b'-1', b'0', b'1', b'1e308', b'null', b'~', b'true', b'{}', b'[]', b'"', b"'",
    b'\x00', b'\xff\xfe', b'\xef\xbb\xbf', b'../../../../etc/passwd', b'/dev/zero',
    b'file:///etc/passwd', b'%s%n', b'${HOME}',
    b'!!python/object/apply:os.system ["true"]', b'&a [*a]', b'*a', b'<<: *a', b'2026-13-45',
    b'[' * 300, b'{a: ' * 60, b'- ' * 200, b'0b1', b'1_000', b'12:30:45', b'=', b'? ', b'|', b'>',
    b'#', b',', b';', b'\t', b'\r', b'\n\n', b'10 %', b'rad', b'kg m2', b'A' * 3000, 'ß'.encode(),
    b'\xf0\x9f\x92\xa9', b'\xed\xa0\x80')
_TOKEN = re.compile(rb'[A-Za-z_]+|[-+0-9.eE]+|[^\sA-Za-z0-9_]')


def spoilt(content: bytes, random: Random, text: bool,
           others: list[bytes] | None = None) -> bytes:
    """Return what a few spoilings make of a file; ``others`` may be mixed into it."""
    made = bytearray(content)
    for _ in range(random.choice((1, 1, 1, 2, 3, 8))):
        kinds = _OF_TEXT if text and random.random() < 0.8 else _OF_BYTES
        made = bytearray(random.choice(kinds)(made, random, others or [content]))
        if len(made) > 4_000_000:
            made = made[:4_000_000]
    return bytes(made)


def _place(made: bytearray, random: Random, size: int = 1) -> int:
    return random.randrange(max(1, len(made) - size + 1))


def _flip(made, random, others):
    if made:
        for _ in range(random.choice((1, 1, 4, 32))):
            made[_place(made, random)] ^= 1 << random.randrange(8)
    return made


def _cut(made, random, others):
    return made[:_place(made, random)]


def _remove(made, random, others):
    at = _place(made, random)
    return made[:at] + made[at + random.choice((1, 2, 8, 64, 1000)):]


def _repeat(made, random, others):
    at, size = _place(made, random), random.choice((1, 9, 64, 1000))
    return made[:at] + made[at:at + size] * random.choice((1, 2, 50)) + made[at:]


def _lie(made, random, others):
    width = random.choice((1, 2, 4, 8))
    if len(made) >= width:
        code = {1: 'B', 2: 'H', 4: 'I', 8: 'Q'}[width]
        pack_into(random.choice('<>') + code, made, _place(made, random, width),
                  random.choice(LENGTHS) % (1 << 8 * width))
    return made


def _splice(made, random, others):
    other = random.choice(others)
    at, there = _place(made, random), random.randrange(max(1, len(other)))
    return made[:at] + other[there:there + random.choice((8, 200, 5000))] + made[at:]


def _noise(made, random, others):
    at = _place(made, random)
    made[at:at + random.choice((1, 8, 100))] = random.randbytes(random.choice((1, 8, 100)))
    return made


def _word(made, random, others):
    tokens = list(_TOKEN.finditer(made))
    if not tokens:
        return made + random.choice(WORDS)
    token = random.choice(tokens)
    return made[:token.start()] + random.choice(WORDS) + made[token.end():]


def _swap(made, random, others):
    tokens = list(_TOKEN.finditer(made))
    if len(tokens) < 2:
        return made
    one, two = sorted(random.sample(tokens, 2), key=lambda token: token.start())
    return (made[:one.start()] + made[two.start():two.end()] + made[one.end():two.start()]
            + made[one.start():one.end()] + made[two.end():])


def _lines(made, random, others):
    lines = bytes(made).split(b'\n')
    at = random.randrange(len(lines))
    match random.randrange(4):
        case 0:
            del lines[at]
        case 1:
            lines.insert(at, lines[random.randrange(len(lines))])
        case 2:
            lines[at] = b' ' * random.choice((1, 2, 4)) + lines[at]
        case _:
            lines[at] = random.choice(WORDS) + b': ' + random.choice(WORDS)
    return bytearray(b'\n'.join(lines))


_OF_BYTES = (_flip, _cut, _remove, _repeat, _lie, _lie, _splice, _noise)
_OF_TEXT = (_word, _word, _swap, _lines, _lines, _cut, _repeat, _splice)
