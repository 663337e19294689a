"""Studio: an HTML file that simulates hammers in the browser and plots their motions.

`live_page` returns the page, `widget` shows it in a notebook and needs the extra `notebook`.
"""

from printhammer.studio.live import live_page, widget
from printhammer.studio.shelf import Shelf

__all__ = ["Shelf", "live_page", "widget"]
