"""A module whose import takes long."""

from time import sleep

sleep(20)
