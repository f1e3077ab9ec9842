"""The live page: served by the helper process, drawn in the browser."""
