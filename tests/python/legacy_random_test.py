"""Checks that the numbers in tests/unit/base/safetensors_test.cc are NumPy's and follow from its algorithm."""
import sys

try:
    import numpy
except ImportError:
    sys.exit(77)


def words(seed):
    """Yields 32-bit words of the Mersenne twister, like std::mt19937(seed)."""
    state = [seed]
    for i in range(1, 624):
        state.append((1812433253 * (state[-1] ^ (state[-1] >> 30)) + i) & 0xFFFFFFFF)
    while True:
        for i in range(624):
            y = (state[i] & 0x80000000) | (state[(i + 1) % 624] & 0x7FFFFFFF)
            state[i] = state[(i + 397) % 624] ^ (y >> 1) ^ (0x9908B0DF if y & 1 else 0)
        for y in list(state):
            y ^= y >> 11
            y ^= (y << 7) & 0x9D2C5680
            y ^= (y << 15) & 0xEFC60000
            yield y ^ (y >> 18)


def double(stream):
    a = next(stream) >> 5
    b = next(stream) >> 6
    return (a * 67108864.0 + b) / 9007199254740992.0


def permutation(stream, n):
    result = list(range(n))
    for i in range(n - 1, 0, -1):
        mask = (1 << i.bit_length()) - 1
        while True:
            value = next(stream) & mask
            if value <= i:
                break
        result[i], result[value] = result[value], result[i]
    return result


for seed in (0, 1, 42, 12345, 2**32 - 1):
    numpy.random.seed(seed)
    stream = words(seed)
    for n in (1, 2, 3, 10, 1000):
        assert [double(stream) for _ in range(50)] == numpy.random.random_sample(50).tolist(), seed
        assert permutation(stream, n) == numpy.random.permutation(n).tolist(), (seed, n)
numpy.random.seed(0)
assert numpy.random.random_sample() == 0.5488135039273248
numpy.random.seed(42)
assert numpy.random.permutation(10).tolist() == [8, 1, 5, 0, 7, 2, 9, 4, 3, 6]
print("as NumPy has them")
