"""Frames of videos, cameras, folders of pictures and pipes; videos that hold every frame written.

Imports nothing else of `vision`.
"""
