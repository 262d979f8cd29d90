# SPDX-License-Identifier: Apache-2.0
"""The frame reader finds every good frame again, whatever the line does."""

from binascii import crc_hqx

from cobs import cobs
from hypothesis import given
from hypothesis import strategies as st
from towtank_daq.framing import FrameReader, encode_frame, encoded_size

MAX_PAYLOAD = 64
payloads = st.binary(min_size=1, max_size=MAX_PAYLOAD)


def test_known_frame():
    # CRC-16/CCITT-FALSE of "123456789" is the catalogue's check value 0x29B1
    assert encode_frame(b"123456789") == b"\x0c123456789\xb1\x29\x00"


def test_zero_bytes_are_coded_out():
    frame = encode_frame(b"\0\0\0")
    assert frame.index(0) == len(frame) - 1


@given(payloads)
def test_encoded_size(payload):
    assert len(encode_frame(payload)) == encoded_size(len(payload))


@given(st.lists(payloads, max_size=8), st.data())
def test_frames_survive_any_cutting(sent, data):
    stream = b"".join(map(encode_frame, sent))
    cuts = sorted(data.draw(st.lists(st.integers(0, len(stream)), max_size=10)))
    reader = FrameReader(MAX_PAYLOAD)
    got = []
    for start, end in zip([0, *cuts], [*cuts, len(stream)], strict=True):
        got += reader.feed(stream[start:end])
    assert got == sent
    assert (reader.counters.frames, reader.counters.bad) == (len(sent), 0)


@given(st.binary(max_size=300), st.lists(payloads, min_size=1, max_size=4))
def test_back_in_step_at_the_next_zero(garbage, sent):
    """Whatever came before, frames after a zero arrive, and after them nothing is left over."""
    reader = FrameReader(MAX_PAYLOAD)
    before = reader.feed(garbage + b"\0")
    assert reader.feed(b"".join(map(encode_frame, sent))) == sent
    # Random bytes may hold a good frame by chance (1 in 65536 each): then the encoder says so
    assert all(encode_frame(payload)[:-1] in garbage for payload in before)


@given(payloads, payloads, st.data())
def test_one_flipped_bit_never_gives_a_wrong_payload(first, second, data):
    """A flip hurts at most the frame it hits and, where it hits the zero, the one after it."""
    stream = bytearray(encode_frame(first) + encode_frame(second) + encode_frame(b"last"))
    hurt = len(encode_frame(first))
    bit = data.draw(st.integers(0, 8 * hurt - 1))
    stream[bit // 8] ^= 1 << bit % 8
    reader = FrameReader(MAX_PAYLOAD)
    got = reader.feed(bytes(stream))
    assert got[-1] == b"last"
    # A flip may cut a frame in two by a false zero; each part is then refused by its CRC except
    # for a chance of 1 in 65536, in which the part carries a CRC that fits
    assert set(got) <= {first, second, b"last"} or any(
        crc_hqx(p, 0xFFFF).to_bytes(2, "little") in bytes(stream) for p in got
    )
    assert first not in got or first in (second, b"last")
    assert reader.counters.bad >= 1


@given(st.lists(st.binary(min_size=1, max_size=5000), max_size=5))
def test_memory_is_bounded(chunks):
    reader = FrameReader(MAX_PAYLOAD)
    for chunk in chunks:
        reader.feed(chunk.replace(b"\0", b"\1"))
        assert len(reader._pending) <= MAX_PAYLOAD + 3


def test_each_kind_of_damage_is_counted():
    reader = FrameReader(MAX_PAYLOAD)
    assert reader.feed(b"\x05ab\0") == []  # COBS code points past the end
    assert reader.feed(cobs.encode(b"payload\0\0") + b"\0") == []  # CRC of another payload
    assert reader.feed(cobs.encode(b"ab") + b"\0") == []  # CRC with nothing before it
    assert reader.feed(b"\x01" * 500) == []
    assert reader.feed(b"\x01" * 500 + b"\0") == []  # one frame that is much too long
    counters = reader.counters
    assert (counters.bad_cobs, counters.bad_crc, counters.bad_length) == (1, 1, 2)
    assert reader.feed(encode_frame(b"good")) == [b"good"]


def test_empty_frames_are_no_errors():
    reader = FrameReader(MAX_PAYLOAD)
    assert reader.feed(b"\0\0\0" + encode_frame(b"x") + b"\0") == [b"x"]
    assert reader.counters.bad == 0


def test_reset_forgets_a_half_frame():
    reader = FrameReader(MAX_PAYLOAD)
    reader.feed(encode_frame(b"cut")[:3])
    reader.reset()
    assert reader.feed(encode_frame(b"whole")) == [b"whole"]
    assert reader.counters.bad == 0
