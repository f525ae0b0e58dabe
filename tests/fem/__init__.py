"""Structures assemble, buckle and recover stresses as closed forms say, in dense and block storage."""
