"""The live page: the helper process serves it, the browser draws it."""
