"""The objective's terms: a term is one module in this folder that registers a `Term`; nothing else
has to change."""
