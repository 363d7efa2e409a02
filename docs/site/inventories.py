"""Inventories of other projects' sites: links to them where there is a network, none without."""

from __future__ import annotations

import urllib.request
from collections.abc import Mapping

_WAIT_S = 3.0


def reachable(sites: Mapping[str, str]) -> dict[str, tuple[str, None]]:
    """Leave out sites whose inventory cannot be fetched, so that a build without network is one.

    Args:
        sites: name -> address of a Sphinx site. After the first that fails none is asked.
    """
    found: dict[str, tuple[str, None]] = {}
    for name, address in sites.items():
        try:
            with urllib.request.urlopen(f"{address}objects.inv", timeout=_WAIT_S) as answer:
                if not answer.read(16).startswith(b"# Sphinx"):
                    break
        except OSError:
            break
        found[name] = (address, None)
    return found
