"""Files in and out; each format imports what it needs when it is called."""

from .matrices import read_dmig as read_dmig
from .matrices import read_matrix_market as read_matrix_market
from .matrices import read_op4 as read_op4
from .uff import read_uff as read_uff
from .uff import write_uff as write_uff
