"""The sockets and serial ports under a link, and the addresses that name them."""
