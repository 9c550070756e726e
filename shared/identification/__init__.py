"""Finds what a simulation gets wrong and names the cause, or says that it does not know.

``find.py`` runs the steps of ``docs/identify_method.md``: ``dataset`` is read, ``arm`` is what
moves, ``noise`` what repeats differ by, ``fitting`` fits the base, ``search`` looks for causes of
the ``catalogue`` (made of ``laws``), ``gate`` decides, ``leftover`` locates the rest,
``conclusion`` says it. ``excitation`` designs recordings; ``hidden`` makes data sets that test all
this.
"""
