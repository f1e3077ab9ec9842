"""The experiments of the paper, one module each: figures 2 to 5, sample rates, appendix A."""
