"""Addresses as people type them are understood, or answered with the right form."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sparsor.errors import InputError, LinkError
from sparsor.link.ports.addresses import Address, parse_address


@pytest.mark.parametrize(
    ("typed", "url"),
    [
        ("udpin://0.0.0.0:14540", "udpin://0.0.0.0:14540"),
        ("udpin:0.0.0.0:14550", "udpin://0.0.0.0:14550"),
        ("udp:0.0.0.0:14550", "udpin://0.0.0.0:14550"),
        ("udp://:14540", "udpin://0.0.0.0:14540"),
        ("udp:127.0.0.1:14550", "udpin://127.0.0.1:14550"),  # MAVProxy's --master
        ("14550", "udpin://0.0.0.0:14550"),
        (" UDPOUT:192.168.1.5:14550 ", "udpout://192.168.1.5:14550"),
        ("udpout://[::1]:14550", "udpout://[::1]:14550"),
        ("tcp:127.0.0.1:5760", "tcpout://127.0.0.1:5760"),
        ("tcp://sitl.local:5760", "tcpout://sitl.local:5760"),
        ("tcpin://0.0.0.0:5760", "tcpin://0.0.0.0:5760"),
        ("tcpin:0.0.0.0:5760", "tcpin://0.0.0.0:5760"),
        ("/dev/ttyUSB0", "serial:///dev/ttyUSB0:57600"),
        ("/dev/ttyACM0,57600", "serial:///dev/ttyACM0:57600"),  # MAVProxy's --master with a baud rate
        ("/dev/cu.usbmodem1,115200", "serial:///dev/cu.usbmodem1:115200"),
        ("/dev/ttyACM0,115200", "serial:///dev/ttyACM0:115200"),
        ("/dev/serial/by-id/usb-ArduPilot_X-if00:115200", "serial:///dev/serial/by-id/usb-ArduPilot_X-if00:115200"),
        ("serial:/dev/ttyS0:921600", "serial:///dev/ttyS0:921600"),
        ("serial:///dev/ttyS0", "serial:///dev/ttyS0:57600"),
        ("COM3", "serial://COM3:57600"),
        ("com12:115200", "serial://COM12:115200"),
        (r"\\.\COM10", "serial://COM10:57600"),
        ("serial://COM3:57600", "serial://COM3:57600"),
    ],
)
def test_an_address_is_understood(typed, url):
    assert parse_address(typed).url == url
    assert parse_address(url).url == url


@pytest.mark.parametrize(
    ("typed", "answer"),
    [
        ("udp:192.168.1.5:14550", "udpout://192.168.1.5:14550"),
        ("udp://127.0.0.1:14540", "udpin://0.0.0.0:14540"),
        ("192.168.1.5:5760", "tcpout://192.168.1.5:5760"),
        ("udpout://0.0.0.0:14550", "udpin://0.0.0.0:14550"),
        ("tcp:0.0.0.0:5760", "tcpin://0.0.0.0:5760"),
        ("udpbcast:192.168.1.255:14550", "udpin://0.0.0.0:14550"),
        ("udpin://0.0.0.0", "no port"),
        ("udpin://0.0.0.0:99999", "1..65535"),
        ("/dev/ttyUSB0:fast", "300..12000000"),
        ("serial://", "names no device"),
        ("http://localhost:80", "begins with 'http://'"),
        ("udpout://::1:14550", "brackets"),
        ("", "not an address"),
        ("drone", "udpin://0.0.0.0:14550"),
        ("127.0.0.1:14550", "to listen for the vehicle give udpin://0.0.0.0:14550"),
        (":14550", "to listen for the vehicle give udpin://0.0.0.0:14550"),
        ("localhost:14550", "to send to it first udpout://localhost:14550, or to use TCP tcpout://localhost:14550"),
        ("192.168.4.1", "known are udpin://0.0.0.0:14550"),
    ],
)
def test_what_is_not_plain_is_answered_with_the_right_form(typed, answer):
    with pytest.raises(LinkError) as refused:
        parse_address(typed)
    assert answer in str(refused.value)
    assert isinstance(refused.value, InputError)


@given(st.text(max_size=40) | st.builds("{}:{}".format, st.sampled_from(["udp", "tcpin:/", "serial"]), st.text()))
def test_any_text_is_an_address_or_a_sentence(typed):
    try:
        address = parse_address(typed)
    except LinkError:
        return
    assert isinstance(address, Address)
    assert parse_address(address.url) == address
