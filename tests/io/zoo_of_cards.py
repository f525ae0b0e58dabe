"""Decks that use every card that is read, once each."""

#: Bars, springs, a bush, masses, coordinate systems, every kind of support and tie, all three forms of fields.
FRAME = """SOL 103
CEND
SPC = 7
MPC = 3
BEGIN BULK
PARAM,POST,-1
PARAM,WTMASS,0.5
CORD2R  1       0       0.      0.      0.      0.      0.      1.      +A
+A      1.      1.      0.
CORD2C* 2               0               0.              0.
*       0.              0.              0.              1.
*       1.              0.              0.
CORD1R,3,1,2,3
CORD2S,4,1,0.,0.,0.,0.,0.,1.
,1.,0.,0.
GRDSET,,,,,,0
GRID,1,,0.,0.,0.
GRID,2,,1.,0.,0.,,
GRID,3,,1.,1.,0.
GRID,4,2,2.,30.,1.,2
GRID,5,1,3.,0.,0.,1
GRID,6,3,1.,1.,1.
GRID,7,4,1.,90.,45.
MAT1,1,2.1+11,,0.3,7850.
MAT1    2       7.+10   2.6+10          2700.
PBAR,1,1,1.-3,2.-7,1.-7,3.-7,0.5
$ a comment inside a card
+,,,,,,,,,
+,0.8,0.85
PBEAM,2,2,1.-3,2.-7,1.-7,0.,3.-7
PROD,3,1,1.-4
PBUSH,4,K,1.+5,2.+5,3.+5,4.+3,5.+3,6.+3
,,B,1.,2.,3.,4.,5.,6.
PELAS,5,1.+4
CBAR,1,1,1,2,0.,1.,0.
CBAR,2,1,2,3,6,,,GGG
,,5,0.,0.,0.1,0.,0.,0.1
CBEAM,3,2,3,4,0.,0.,1.
CROD,4,3,4,5
CROD,14,3,2,5
CROD,24,3,1,5
CBUSH,5,4,5,6,,,,0
CBUSH,15,4,6,,,,,2
CELAS1,6,5,6,1,7,1
CELAS2,7,1.+4,7,2
CELAS2,8,1.+4,7,3,6,3
CONM2,9,6,1,10.,0.1,0.,0.
,1.,0.1,2.,0.,0.,3.
CONM2,10,7,,5.
SPC1,9,123456,1
SPC,8,2,1,0.
SPC,8,4,2,0.
SPCADD,7,8,9
MPC,3,5,2,1.,4,3,-0.5
RBE2,21,3,123,6
EIGRL,1,,,5
FORCE,1,6,,1.,0.,0.,1.
ENDDATA
"""

#: A plate of a quadrilateral and two triangles on a brick, averaged by an RBE3.
PLATE = """GRID           1             0.0     0.0     0.0
GRID           2             1.0     0.0     0.0
GRID           3             1.0     1.0     0.0
GRID           4             0.0     1.0     0.0
GRID           5             0.0     0.0     1.0
GRID           6             1.0     0.0     1.0
GRID           7             1.0     1.0     1.0
GRID           8             0.0     1.0     1.0
GRID           9             2.0     0.0     1.0
GRID          10             2.0     1.0     1.0
GRID          11             0.5     0.5     2.0
MAT1           1  2.1+11             0.3   7850.
PSOLID         1       1
PSHELL         2       1    0.01       1               1
CHEXA          1       1       1       2       3       4       5       6
               7       8
CQUAD4         2       2       6       9      10       7
CTRIA3         3       2       5       6       7
CTRIA3         4       2       5       7       8
RBE3          20              11  123456      1.     123       5       6+
+              7       8
CONM2         30      11            100.
SPC1           1     123       1    THRU       4
ENDDATA
"""

ZOO = {"frame": FRAME, "plate": PLATE}
