"""A program that ends when a process that it starts imports it."""

import os

os._exit(5)
