#!/usr/bin/env python3
"""Makes the textures of this folder: gray patterns of 256 x 256 pixels that repeat without a seam. Standard library only. A
material's own color tints them. Run it from anywhere; it overwrites the PNG files next to it.
"""
import math
import pathlib
import random
import struct
import zlib

SIZE = 256
LIGHT, DARK = 238, 96


def checker(x, y):
    return LIGHT if (x // 32 + y // 32) % 2 else DARK


def stripes(x, y):
    return LIGHT if (x + y) // 16 % 2 else DARK


def dots(x, y):
    """Returns two grids of dots, one between the dots of the other."""
    radius = min(math.hypot((x + shift) % 64 - 31.5, (y + shift) % 64 - 31.5) for shift in (0, 32))
    return DARK + (LIGHT - DARK) * min(1, max(0, radius - 12))


def tiles(x, y):
    """Returns square tiles of different shades, and the joints between them."""
    if x % 64 < 3 or y % 64 < 3:
        return DARK
    return 200 + random.Random(x // 64 + 100 * (y // 64)).uniform(-30, LIGHT - 200)


class Noise:
    """Smooth noise from -1 to 1 that repeats every SIZE pixels; cells: number of random values along each side of the tile."""

    def __init__(self, cells, seed):
        rng = random.Random(seed)
        self.cells = cells
        self.values = [rng.uniform(-1, 1) for _ in range(cells * cells)]

    def __call__(self, x, y):
        u, v = x * self.cells / SIZE, y * self.cells / SIZE
        i, j = int(u), int(v)
        a, b = (t * t * (3 - 2 * t) for t in (u - i, v - j))

        def at(m, n):
            return self.values[m % self.cells + self.cells * (n % self.cells)]

        return ((1 - a) * (1 - b) * at(i, j) + a * (1 - b) * at(i + 1, j)
                + (1 - a) * b * at(i, j + 1) + a * b * at(i + 1, j + 1))


OCTAVES = [(Noise(2 ** k, k), 0.5 ** k) for k in range(2, 7)]


def turbulence(x, y):
    return sum(weight * noise(x, y) for noise, weight in OCTAVES) / sum(weight for _, weight in OCTAVES)


def marble(x, y):
    """Returns thin dark veins along a diagonal."""
    vein = abs(math.sin(2 * math.pi * (x + y) / SIZE + 7 * turbulence(x, y)))
    return DARK + (LIGHT - DARK) * vein ** 0.4


GRAIN = Noise(128, 1)


def concrete(x, y):
    return 165 + 55 * turbulence(x, y) + 22 * GRAIN(x, y)


def write_png(path, shade):
    rows = b"".join(b"\0" + bytes(max(0, min(255, round(shade(x, y)))) for x in range(SIZE)) for y in range(SIZE))

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    path.write_bytes(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", SIZE, SIZE, 8, 0, 0, 0, 0))
                     + chunk(b"IDAT", zlib.compress(rows, 9)) + chunk(b"IEND", b""))


for pattern in (checker, concrete, dots, marble, stripes, tiles):
    write_png(pathlib.Path(__file__).with_name(pattern.__name__ + ".png"), pattern)
