"""The block-sparse solver is dense LAPACK, for every graph, kind and precision, with derivatives."""
