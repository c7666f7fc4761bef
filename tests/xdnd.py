"""Drag and drop as a file manager does it: the source's side of the XDND protocol, version 5.

    source                                   target (the window)
    XdndEnter: the types of data         →
    XdndPosition: the cursor             →
                                         ←   XdndStatus: whether a drop is accepted
    XdndDrop                             →
                                         ←   SelectionRequest: asks for text/uri-list
    SelectionNotify: the data are ready  →
                                         ←   XdndFinished

https://freedesktop.org/wiki/Specifications/XDND/
"""

import select
import time

from Xlib import X, display
from Xlib.protocol import event

VERSION = 5
_ANSWER_S = 60.0  # there are slow machines


def drop(server, at, paths):
    """Drop files on the one window of an X server that takes drops; returns whether the window took them.

    Parameters
    ----------
    server
        The X server's name, as DISPLAY has it.
    at
        The place on the screen, x and y.
    paths
        `pathlib.Path`s of the files, absolute.
    """
    x_display = display.Display(server)
    try:
        return _Source(x_display, paths).drop(at)
    finally:
        x_display.close()


def _below(window):
    for child in window.query_tree().children:
        yield child
        yield from _below(child)


class _Source:
    def __init__(self, x_display, paths):
        self.display = x_display
        self.window = x_display.screen().root.create_window(-1, -1, 1, 1, 0, X.CopyFromParent)
        self.data = "".join(f"{path.as_uri()}\r\n" for path in paths).encode()
        self.window.set_selection_owner(self._atom("XdndSelection"), X.CurrentTime)

    def drop(self, at):
        aware, windows = self._atom("XdndAware"), _below(self.display.screen().root)
        target = next(each for each in windows if each.get_full_property(aware, X.AnyPropertyType))
        uris, copy = self._atom("text/uri-list"), self._atom("XdndActionCopy")
        self._tell(target, "XdndEnter", VERSION << 24, uris, 0, 0)
        self._tell(target, "XdndPosition", 0, at[0] << 16 | at[1], X.CurrentTime, copy)
        if not self._answer("XdndStatus")[1] & 1:
            return False
        self._tell(target, "XdndDrop", 0, X.CurrentTime, 0, 0)
        return self._answer("XdndFinished")[1] != 0  # GLFW tells how many bytes it took, instead of 1

    def _atom(self, name):
        return self.display.intern_atom(name)

    def _tell(self, target, name, *words):
        message = event.ClientMessage(
            window=target, client_type=self._atom(name), data=(32, [self.window.id, *words][:5])
        )
        target.send_event(message)
        self.display.flush()

    def _answer(self, name):
        """Words of the message of that name; whoever asks for the files meanwhile gets them."""
        end = time.monotonic() + _ANSWER_S
        while time.monotonic() < end:
            if not self.display.pending_events():
                select.select([self.display], [], [], 0.1)
                continue
            told = self.display.next_event()
            if told.type == X.SelectionRequest:
                self._give(told)
            elif told.type == X.ClientMessage and told.client_type == self._atom(name):
                return told.data[1]
        raise AssertionError(f"no {name} within {_ANSWER_S} s")

    def _give(self, request):
        request.requestor.change_property(request.property, request.target, 8, self.data)
        names = ("time", "requestor", "selection", "target", "property")
        request.requestor.send_event(event.SelectionNotify(**{name: getattr(request, name) for name in names}))
        self.display.flush()
