"""The picture of heights along a flight."""

from __future__ import annotations

import io

import numpy as np
from PIL import Image

from sparsor.plot import HeightProfile, height_profile_png


def test_the_same_profile_gives_the_same_bytes_and_another_other_ones():
    along = np.linspace(0, 5, 200)
    ground = 20 * np.sin(along)

    def picture(flown):
        return height_profile_png(
            HeightProfile(
                "t", along, ground, ground + 45, flown, along[::50], flown[::50], along[25::50], flown[25::50], 50.0
            )
        )

    one = picture(ground + 50)
    assert one == picture(ground + 50)
    assert one != picture(ground + 60)
    assert Image.open(io.BytesIO(one)).size[0] == 1400
