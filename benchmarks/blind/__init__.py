"""Blind benchmark of ``stepgauge diagnose``: concealed causes, made by code that shares nothing with it."""
