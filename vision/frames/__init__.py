"""Frames of videos, cameras, folders of pictures and pipes; writers of videos and pictures.

Imports nothing else of `vision`.
"""
