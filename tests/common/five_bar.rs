//! A closed chain as a URDF.

/// A five-bar linkage in the plane, both distal links on a pin `tip`.
pub const URDF: &str = r#"<robot name="five_bar">
<link name="base"/>
<link name="left1"><inertial><origin xyz="0.1 0.01 0"/><mass value="0.5"/>
 <inertia ixx="0.0005" ixy="0" ixz="0" iyy="0.003" iyz="0" izz="0.003"/></inertial></link>
<link name="left2"><inertial><origin xyz="0.15 0 0"/><mass value="0.3"/>
 <inertia ixx="0.0003" ixy="0" ixz="0" iyy="0.004" iyz="0" izz="0.004"/></inertial></link>
<link name="right1"><inertial><origin xyz="0.1 -0.01 0"/><mass value="0.6"/>
 <inertia ixx="0.0005" ixy="0" ixz="0" iyy="0.003" iyz="0" izz="0.003"/></inertial></link>
<link name="right2"><inertial><origin xyz="0.15 0 0.01"/><mass value="0.3"/>
 <inertia ixx="0.0003" ixy="0" ixz="0" iyy="0.004" iyz="0" izz="0.004"/></inertial></link>
<link name="tip"/>
<link name="left_end"/>
<link name="right_end"/>
<joint name="motor_left" type="revolute"><parent link="base"/><child link="left1"/>
 <axis xyz="0 0 1"/><limit lower="-4" upper="4" effort="10" velocity="20"/></joint>
<joint name="elbow_left" type="revolute"><parent link="left1"/><child link="left2"/>
 <origin xyz="0.2 0 0"/><axis xyz="0 0 1"/><limit lower="-3" upper="3" effort="1" velocity="50"/>
 <dynamics damping="0.02"/></joint>
<joint name="motor_right" type="revolute"><parent link="base"/><child link="right1"/>
 <origin xyz="0.15 0 0"/><axis xyz="0 0 1"/><limit lower="-4" upper="4" effort="10" velocity="20"/></joint>
<joint name="elbow_right" type="revolute"><parent link="right1"/><child link="right2"/>
 <origin xyz="0.2 0 0"/><axis xyz="0 0 1"/><limit lower="-3" upper="3" effort="1" velocity="50"/></joint>
<joint name="pin" type="revolute"><parent link="left2"/><child link="tip"/>
 <origin xyz="0.3 0 0"/><axis xyz="0 0 1"/><limit lower="-4" upper="4" effort="1" velocity="50"/></joint>
<joint name="at_left" type="fixed"><parent link="left2"/><child link="left_end"/><origin xyz="0.3 0 0"/></joint>
<joint name="at_right" type="fixed"><parent link="right2"/><child link="right_end"/><origin xyz="0.3 0 0"/></joint>
</robot>"#;
