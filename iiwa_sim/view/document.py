"""What a browser loads first, viser's document, with what it lacks: our name, a key that always stops, and
pictures that are drawn in time where no GPU does it."""

from __future__ import annotations

import gzip
import html

GZIP = "gzip"
_TITLE = b"<title>Viser</title>"

# viser's hotkeys rest while a text field has the focus, and Ctrl-E would move the camera besides stopping the
# robot. So the key is said again where no field is, and the camera, which listens behind, does not hear it.
# Smooth edges are four samples a pixel: drawn in software they take four fifths of the time of a frame.
# The panel's tabs are made to fit in one row.
_ADDED = """\
<style>[role="tab"] { padding-inline: 0.6em !important; font-size: 0.85em !important; }</style>
<script>
(() => {
  const stops = event =>
    (event.ctrlKey || event.metaKey) && !event.altKey && !event.shiftKey && event.key.toLowerCase() === "e";
  const inField = target => target instanceof Element && target.closest("input, textarea, select") !== null;
  addEventListener("keydown", event => {
    if (!stops(event)) return;
    event.preventDefault();
    if (!inField(event.target)) return;
    event.stopImmediatePropagation();
    const { key, code, ctrlKey, metaKey } = event;
    document.body.dispatchEvent(
      new KeyboardEvent("keydown", { key, code, ctrlKey, metaKey, bubbles: true, cancelable: true }));
  }, true);
  document.documentElement.addEventListener("keydown", event => {
    if (stops(event)) event.stopPropagation();
  });

  const probe = document.createElement("canvas").getContext("webgl2");
  const names = probe && probe.getExtension("WEBGL_debug_renderer_info");
  const drawnBy = probe ? probe.getParameter(names ? names.UNMASKED_RENDERER_WEBGL : probe.RENDERER) : "";
  if (/swiftshader|llvmpipe|softpipe|software|basic render/i.test(drawnBy)) {
    const real = HTMLCanvasElement.prototype.getContext;
    HTMLCanvasElement.prototype.getContext = function (kind, options) {
      return real.call(this, kind, kind.startsWith("webgl") ? { ...options, antialias: false } : options);
    };
  }
  if (probe) probe.getExtension("WEBGL_lose_context")?.loseContext();
})();
</script>
"""


def completed(body: bytes, encoding: str, title: str) -> bytes:
    """A document as viser sends it, in this Content-Encoding, with a title and with our script."""
    text = gzip.decompress(body) if encoding == GZIP else body
    head = f"<title>{html.escape(title)}</title>\n{_ADDED}".encode()
    changed = text.replace(_TITLE, head, 1)
    return gzip.compress(changed) if encoding == GZIP else changed
