"""The browser of this machine, if there is one that can show a window."""

import os
import sys


def missing_browser() -> str:
    """Return why no browser can be opened here, or an empty text if one can."""
    if sys.platform.startswith("linux") and not (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
        return "there is no display here"  # text browsers would take the terminal from the run
    import webbrowser

    try:
        webbrowser.get()
    except webbrowser.Error:
        return "no browser found"
    return ""


def opened_in_browser(url: str) -> str:
    """Open the address in the browser; return why that was not possible, or an empty text."""
    import webbrowser

    return missing_browser() or ("" if webbrowser.open(url) else "the browser did not start")
