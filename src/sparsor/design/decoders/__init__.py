"""Decoders: from measurements to the map, its level, its amplitude and its uncertainty."""

from sparsor.design.decoders.decode import Decoded, DecoderName, decode, decode_each
from sparsor.design.decoders.measurements import Measurements

__all__ = ["Decoded", "DecoderName", "Measurements", "decode", "decode_each"]
