"""Small models as text: an arm in URDF, a bench of every joint and equality in MJCF."""

ARM_URDF = """<?xml version="1.0"?>
<robot name="arm">
  <link name="base"><inertial><mass value="3"/><origin xyz="0 0 0.1"/>
    <inertia ixx="0.02" iyy="0.02" izz="0.03" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <link name="upper"><inertial><mass value="2"/><origin xyz="0.2 0.01 0" rpy="0.3 0.2 0.1"/>
    <inertia ixx="0.005" iyy="0.03" izz="0.031" ixy="0.001" ixz="0.002" iyz="-0.001"/></inertial>
    <visual><geometry><mesh filename="package://nowhere/upper.dae"/></geometry></visual>
    <collision><geometry><mesh filename="/etc/passwd"/></geometry></collision></link>
  <link name="fore"><inertial><mass value="1.5"/><origin xyz="0.15 0 0"/>
    <inertia ixx="0.002" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <link name="slide"><inertial><mass value="0.7"/>
    <inertia ixx="0.001" iyy="0.002" izz="0.002" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <link name="flange"><inertial><mass value="0.4"/><origin xyz="0 0.02 0.05" rpy="0 0 1"/>
    <inertia ixx="0.0003" iyy="0.0004" izz="0.0005" ixy="0.00005" ixz="0" iyz="0"/></inertial></link>
  <link name="tool"/>
  <link name="finger"><inertial><mass value="0.1"/><origin xyz="0.02 0 0"/>
    <inertia ixx="0.0001" iyy="0.0001" izz="0.0001" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="shoulder" type="revolute"><parent link="base"/><child link="upper"/>
    <origin xyz="0 0 0.3" rpy="0.1 -0.2 0.3"/><axis xyz="0 1 2"/>
    <limit lower="-1.5" upper="2" velocity="3" effort="80"/><dynamics damping="0.6" friction="0.2"/></joint>
  <joint name="elbow" type="continuous"><parent link="upper"/><child link="fore"/>
    <origin xyz="0.4 0 0"/><axis xyz="0 1 0"/><limit velocity="4" effort="30"/></joint>
  <joint name="rail" type="prismatic"><parent link="fore"/><child link="slide"/>
    <origin xyz="0.3 0 0" rpy="0 0.5 0"/><axis xyz="1 0 0"/>
    <limit lower="0" upper="0.2" effort="50" velocity="1"/></joint>
  <joint name="bolts" type="fixed"><parent link="slide"/><child link="flange"/>
    <origin xyz="0.05 0 0" rpy="0 0 0.7"/></joint>
  <joint name="grip" type="fixed"><parent link="flange"/><child link="tool"/><origin xyz="0 0 0.12"/></joint>
  <joint name="squeeze" type="revolute"><parent link="flange"/><child link="finger"/>
    <origin xyz="0 0.03 0"/><axis xyz="0 0 1"/><limit lower="0" upper="1" effort="5" velocity="1"/>
    <mimic joint="elbow" multiplier="-0.5" offset="0.1"/></joint>
  <transmission name="motor"/>
</robot>
"""

BENCH_MJCF = """<mujoco model="bench">
  <compiler angle="degree" eulerseq="zyx"/>
  <option gravity="0.1 0.2 -9.81"/>
  <default><geom density="700"/><joint damping="0.2"/></default>
  <worldbody>
    <light pos="0 0 3"/><camera name="eye" pos="1 1 1"/>
    <geom type="plane" size="1 1 .1"/>
    <site name="mark" pos="0.1 0.2 0.3" euler="10 20 30"/>
    <body name="stand" pos="0.2 0 0.1" euler="5 10 15">
      <geom type="box" size=".1 .1 .2"/>
      <body name="turret" pos="0 0.1 0.3">
        <joint name="yaw" axis="0 0 1" pos="0.02 0.01 0" ref="20" stiffness="3" springref="40"
          range="-90 90" limited="true"/>
        <joint name="lift" type="slide" axis="0 1 1" ref="0.1" stiffness="50" armature="0.3"/>
        <geom type="capsule" size=".04" fromto="0 0 0 .2 0 .1"/>
        <body name="head" pos=".2 0 .1" quat="1 0.2 0 0.1">
          <joint name="neck" type="ball" pos="0.01 0 0.02" stiffness="4" damping="0.3"/>
          <geom type="ellipsoid" size=".1 .05 .07"/>
          <site name="nose" pos="0.1 0 0"/>
          <body pos="0 0 0.1">
            <geom type="sphere" size=".03"/>
            <body name="ear" pos="0.03 0 0.02"><joint axis="1 0 1" armature="0.02"/>
              <geom type="box" size=".02 .01 .03"/></body>
          </body>
        </body>
      </body>
    </body>
    <body name="ball" pos="1 0 2"><freejoint name="float"/><geom type="box" size=".1 .2 .3" pos="0.05 0 0"/></body>
  </worldbody>
  <sensor><framepos objtype="site" objname="nose"/></sensor>
  <actuator>
    <motor name="push" joint="lift" gear="3" ctrllimited="true" ctrlrange="-1 1"/>
    <position name="aim" joint="yaw" kp="7" kv="0.5" gear="2"/>
    <general name="lag" joint="yaw" dyntype="filter" dynprm="0.1"/>
  </actuator>
  <keyframe><key name="up" qpos="0.5 0.2 1 0 0 0 0.3 1 0 2 1 0 0 0"/></keyframe>
</mujoco>
"""

# a four-bar closed by a connect, a plate on the rocker by a weld, a cam on the crank and a rack
LOOPS_MJCF = """<mujoco>
  <compiler angle="radian"/>
  <worldbody>
    <body name="crank"><joint name="A" axis="0 1 0"/>
      <geom type="capsule" size=".02" fromto="0 0 0 0 0 .3"/>
      <body name="coupler" pos="0 0 .3"><joint name="B" axis="0 1 0"/>
        <geom type="capsule" size=".02" fromto="0 0 0 .8 0 .1"/></body></body>
    <body name="rocker" pos=".9 0 0"><joint name="D" axis="0 1 0" damping="0.3"/>
      <geom type="capsule" size=".02" fromto="0 0 0 -.1 0 .4"/></body>
    <body name="plate" pos=".9 .1 .5"><freejoint name="F"/><geom type="box" size=".05 .02 .1" pos="0.02 0 0"/></body>
    <body name="cam" pos="0 .5 0"><joint name="C" axis="0 1 0" ref="0.2"/>
      <geom type="box" size=".1 .02 .1" pos=".1 0 0"/></body>
    <body name="rack" pos="0 .8 0"><joint name="R" type="slide" axis="1 0 0"/>
      <geom type="box" size=".1 .02 .1"/></body>
  </worldbody>
  <equality>
    <connect name="C1" body1="coupler" body2="rocker" anchor=".8 0 .1"/>
    <weld name="W1" body1="rocker" body2="plate"/>
    <joint name="cam law" joint1="C" joint2="A" polycoef="0.1 0.5 0.3 -0.1 0.05"/>
    <joint name="rack law" joint1="R" joint2="C" polycoef="0 0.2 0 0 0"/>
    <connect name="idle" body1="cam" body2="rack" anchor="0 0 0" active="false"/>
  </equality>
</mujoco>
"""

# an arm with every spring, tendon and actuator that is read, and a drone
DRIVES_MJCF = """<mujoco model="drives">
  <compiler angle="radian"/>
  <option gravity="0.1 0.2 -9.81"/>
  <worldbody>
    <site name="roof" pos="0 0 1.4"/><site name="wall" pos="0.05 0.02 1.2"/>
    <body name="arm" pos="0 0 1" gravcomp="0.7">
      <joint name="hinge" axis="0 1 0" stiffness="20 3 2" damping="0.5 0.3 0.2" springref="0.2"
        frictionloss="0.3" armature="0.02"/>
      <geom type="capsule" size=".04" fromto="0 0 0 .4 0 0"/>
      <site name="mid" pos="0.2 0.01 0.05"/>
      <geom name="drum" type="cylinder" size=".03 .05" pos="0.4 0 0.02" euler="1.5708 0 0"/>
      <geom name="ball" type="sphere" size=".02" pos="0.1 0 0.01" contype="0" conaffinity="0"/>
      <body name="fore" pos=".4 0 0">
        <joint name="elbow" axis="0 1 0.1"/>
        <geom type="capsule" size=".03" fromto="0 0 0 .3 0 0"/>
        <site name="tip" pos="0.25 0.02 0.03"/>
        <site name="prop" pos="0.3 0 0" euler="0.2 0.3 0.4"/>
        <body name="slider" pos=".3 0 0">
          <joint name="slide" type="slide" axis="1 0 0"/><geom type="box" size=".02 .03 .04"/></body>
      </body>
    </body>
    <body name="drone" pos="1 0 1"><freejoint name="fly"/><geom type="box" size=".1 .2 .05"/>
      <site name="rotor" pos=".1 .1 0" euler="0.1 0 0"/></body>
  </worldbody>
  <tendon>
    <spatial name="rope" stiffness="300 20" damping="3 1" springlength="0 0.3" frictionloss="0.2">
      <site site="roof"/><site site="mid"/><site site="wall"/></spatial>
    <spatial name="muscle" stiffness="100" damping="2">
      <site site="mid"/><geom geom="drum"/><site site="tip"/></spatial>
    <spatial name="over" stiffness="50"><site site="wall"/><geom geom="ball"/><site site="mid"/></spatial>
    <fixed name="sum" stiffness="10" damping="0.4" frictionloss="0.1" armature="0.05" limited="true" range="-1 2">
      <joint joint="hinge" coef="0.7"/><joint joint="elbow" coef="-1.2"/></fixed>
  </tendon>
  <actuator>
    <motor name="push" joint="slide" gear="3" ctrllimited="true" ctrlrange="-1 1"/>
    <position name="aim" joint="hinge" kp="7" kv="0.5" gear="2" forcerange="-9 9" armature="0.01"/>
    <velocity name="speed" joint="elbow" kv="0.6"/>
    <general name="lag" joint="elbow" dyntype="filter" dynprm="0.1" gainprm="2"/>
    <intvelocity name="iv" joint="slide" kp="5" actrange="-0.2 0.2"/>
    <damper name="damp" joint="slide" kv="2" ctrlrange="0 1"/>
    <cylinder name="cyl" joint="slide" timeconst="0.2" area="0.7" bias="0.1 -2 -0.3"/>
    <motor name="pull" tendon="rope" gear="2"/>
    <position name="flex" tendon="sum" kp="4"/>
    <general name="thrust" site="rotor" gear="0 0.1 1 0 0 0.2" gainprm="3" biastype="affine" biasprm="0.1 0 -0.4"/>
    <general name="odd" joint="elbow" gaintype="affine" gainprm="1 0.5 0.2"
      biastype="affine" biasprm="0.2 -0.3 -0.1"/>
  </actuator>
</mujoco>
"""

# an arm with every joint of SDF, its poses relative to one another in every way
ARM_SDF = """<?xml version="1.0"?>
<sdf version="1.9">
  <world name="hall">
    <gravity>0.1 0.2 -9.7</gravity>
    <model name="arm">
      <pose>0.3 -0.2 0.1 0.1 0.2 0.3</pose>
      <link name="base"><inertial><mass>3</mass><inertia>
        <ixx>0.02</ixx><iyy>0.02</iyy><izz>0.03</izz><ixy>0</ixy><ixz>0</ixz><iyz>0</iyz></inertia></inertial></link>
      <frame name="shoulder_frame" attached_to="base"><pose degrees="true">0.1 0 0.3 10 -20 30</pose></frame>
      <link name="upper"><pose relative_to="shoulder">0.05 0 0.02 0.3 0 0.1</pose>
        <inertial><pose>0.2 0.01 0 0.3 0.2 0.1</pose><mass>2</mass><inertia>
        <ixx>0.005</ixx><iyy>0.03</iyy><izz>0.031</izz><ixy>0.001</ixy><ixz>0.002</ixz><iyz>-0.001</iyz></inertia></inertial>
        <collision name="c"><geometry><box><size>1 1 1</size></box></geometry></collision></link>
      <link name="fore"><pose relative_to="upper">0.4 0.05 0 0 0.2 0</pose>
        <inertial><pose>0.15 0 0 0 0 0</pose><mass>1.5</mass><inertia>
        <ixx>0.002</ixx><iyy>0.01</iyy><izz>0.01</izz><ixy>0</ixy><ixz>0</ixz><iyz>0</iyz></inertia></inertial></link>
      <link name="slide"><pose relative_to="fore">0.3 0 0 0 0.5 0</pose>
        <inertial><mass>0.7</mass><inertia>
        <ixx>0.001</ixx><iyy>0.002</iyy><izz>0.002</izz><ixy>0</ixy><ixz>0</ixz><iyz>0</iyz></inertia></inertial></link>
      <link name="nut"><pose relative_to="slide">0.1 0 0.05 0.2 0 0</pose>
        <inertial><pose>0.01 0.02 0 0 0 0</pose><mass>0.4</mass><inertia>
        <ixx>0.0003</ixx><iyy>0.0004</iyy><izz>0.0005</izz><ixy>0.00005</ixy><ixz>0</ixz><iyz>0</iyz></inertia></inertial></link>
      <link name="wrist"><pose relative_to="fore">0.2 0.1 0.1 0 0 0.4</pose>
        <inertial><pose>0.03 0 0.02 0 0 0</pose><mass>0.3</mass><inertia>
        <ixx>0.0004</ixx><iyy>0.0004</iyy><izz>0.0005</izz><ixy>0</ixy><ixz>0</ixz><iyz>0</iyz></inertia></inertial></link>
      <link name="tool"><pose relative_to="wrist">0 0 0.1 0 0 0</pose>
        <inertial><mass>0.2</mass><inertia>
        <ixx>0.0001</ixx><iyy>0.0001</iyy><izz>0.0001</izz><ixy>0</ixy><ixz>0</ixz><iyz>0</iyz></inertia></inertial></link>
      <joint name="feet" type="fixed"><parent>world</parent><child>base</child></joint>
      <joint name="shoulder" type="revolute"><pose relative_to="shoulder_frame">0 0 0.05 0 0 0.2</pose>
        <parent>shoulder_frame</parent><child>upper</child>
        <axis><xyz expressed_in="base">0 1 2</xyz><limit><lower>-1.5</lower><upper>2</upper><effort>80</effort>
        <velocity>3</velocity></limit><dynamics><damping>0.6</damping></dynamics></axis></joint>
      <joint name="elbow" type="continuous"><pose>0 0 0.01 0.1 0 0</pose><parent>upper</parent><child>fore</child>
        <axis><xyz>0 1 0</xyz></axis></joint>
      <joint name="rail" type="prismatic"><parent>fore</parent><child>slide</child>
        <axis><xyz>1 0 0</xyz><limit><lower>0</lower><upper>0.2</upper></limit></axis></joint>
      <joint name="thread" type="screw"><parent>slide</parent><child>nut</child>
        <screw_thread_pitch>0.05</screw_thread_pitch>
        <axis><xyz>1 0 0</xyz></axis></joint>
      <joint name="cross" type="universal"><parent>fore</parent><child>wrist</child>
        <axis><xyz>1 0 0</xyz></axis><axis2><xyz>0 1 0</xyz></axis2></joint>
      <joint name="socket" type="ball"><pose>0 0 -0.05 0 0 0</pose><parent>wrist</parent><child>tool</child></joint>
      <plugin name="p" filename="lib.so"/>
    </model>
  </world>
</sdf>
"""
