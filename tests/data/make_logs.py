"""Small logs of a motion of two joints in every format that is read: tests/data/logs. All hold the same 200 samples.

    pip install numpy scipy mcap zstandard lz4; python tests/data/make_logs.py
"""
import io
import sqlite3
import struct
from pathlib import Path

import numpy as np
import scipy.io
from mcap.writer import CompressionType, Writer

OUT = Path(__file__).parent / "logs"
OUT.mkdir(exist_ok=True)
N, STEP = 200, 0.01
NAMES = ["wrist_b", "wrist_a"]


def motion():
    t = np.arange(N) * STEP
    q = np.stack([0.5 * np.sin(3 * t) + 0.2 * np.cos(5 * t), 0.4 * np.cos(4 * t) + 0.1 * np.sin(7 * t)], 1)
    dq = np.stack([1.5 * np.cos(3 * t) - np.sin(5 * t), -1.6 * np.sin(4 * t) + 0.7 * np.cos(7 * t)], 1)
    tau = np.stack([3 * np.sin(2 * t + 0.3), 2 * np.sin(3 * t)], 1)
    return t, q, dq, tau


class Cdr:
    """A message of ROS 2, little endian."""

    def __init__(self):
        self.b = bytearray()

    def align(self, n):
        self.b += b"\0" * (-len(self.b) % n)

    def u32(self, x):
        self.align(4)
        self.b += struct.pack("<I", x)

    def text(self, s):
        self.u32(len(s) + 1)
        self.b += s.encode() + b"\0"

    def doubles(self, v):
        self.u32(len(v))
        if len(v):
            self.align(8)
            self.b += struct.pack(f"<{len(v)}d", *v)

    def header(self, t):
        ns = round(t * 1e9)
        self.u32(1700000000 + ns // 10**9)
        self.u32(ns % 10**9)
        self.text("base")

    def done(self):
        return b"\0\1\0\0" + bytes(self.b)


def joint_state(t, q, dq, tau, names=NAMES):
    m = Cdr()
    m.header(t)
    m.u32(len(names))
    for n in names:
        m.text(n)
    for v in (q, dq, tau):
        m.doubles(v)
    return m.done()


def controller_state(t, q, dq, tau):
    m = Cdr()
    m.header(t)
    m.u32(2)
    for n in NAMES:
        m.text(n)
    for pos, vel, eff in ((q + 0.001, dq, []), (q, dq, []), ([], [], []), ([], [], tau)):
        m.doubles(pos)
        m.doubles(vel)
        m.doubles([])
        m.doubles(eff)
        m.u32(0)
        m.u32(0)
    return m.done()


def dynamic_state(t, q, dq, tau):
    m = Cdr()
    m.header(t)
    m.u32(2)
    for n in NAMES:
        m.text(n)
    m.u32(2)
    for j in range(2):
        m.u32(3)
        for s in ("position", "velocity", "effort"):
            m.text(s)
        m.doubles([q[j], dq[j], tau[j]])
    return m.done()


def array(values):
    m = Cdr()
    m.u32(0)
    m.u32(0)
    m.doubles(values)
    return m.done()


def db3(path, t, q, dq, tau):
    path.unlink(missing_ok=True)
    c = sqlite3.connect(path)
    c.execute("PRAGMA page_size=512")  # so that messages overflow their pages
    c.execute("CREATE TABLE topics(id INTEGER PRIMARY KEY,name TEXT NOT NULL,type TEXT NOT NULL,"
              "serialization_format TEXT NOT NULL,offered_qos_profiles TEXT NOT NULL)")
    c.execute("CREATE TABLE messages(id INTEGER PRIMARY KEY,topic_id INTEGER NOT NULL,timestamp INTEGER NOT NULL, "
              "data BLOB NOT NULL)")
    types = {"/joint_states": "sensor_msgs/msg/JointState",
             "/controller/state": "control_msgs/msg/JointTrajectoryControllerState",
             "/dynamic": "control_msgs/msg/DynamicJointState", "/array": "std_msgs/msg/Float64MultiArray"}
    for i, (name, kind) in enumerate(types.items()):
        c.execute("INSERT INTO topics VALUES(?,?,?,'cdr','')", (i + 1, name, kind))
    for i in range(N):
        at = 1700000000 * 10**9 + round(t[i] * 1e9)
        every = [joint_state(t[i], q[i], dq[i], tau[i]), controller_state(t[i], q[i], dq[i], tau[i]),
                 dynamic_state(t[i], q[i], dq[i], tau[i]), array([*q[i], *tau[i]])]
        for k, data in enumerate(every):
            c.execute("INSERT INTO messages(topic_id,timestamp,data) VALUES(?,?,?)", (k + 1, at, data))
        if i % 10 == 0:  # a gripper on the same topic
            c.execute("INSERT INTO messages(topic_id,timestamp,data) VALUES(1,?,?)",
                      (at, joint_state(t[i], [0.1], [0.0], [0.0], ["finger"])))
    c.commit()
    c.close()


def mcap(path, compression, t, q, dq, tau):
    with open(path, "wb") as f:
        w = Writer(f, compression=compression, chunk_size=4096)
        w.start("ros2", "")
        schema = w.register_schema("sensor_msgs/msg/JointState", "ros2msg", b"")
        channel = w.register_channel("/joint_states", "cdr", schema)
        for i in range(N):
            at = 1700000000 * 10**9 + round(t[i] * 1e9)
            # names in another order in every second message
            way = slice(None, None, 1 if i % 2 else -1)
            data = joint_state(t[i], q[i][way], dq[i][way], tau[i][way], NAMES[way])
            w.add_message(channel, at, data, at)
        w.finish()


def mat_big_endian(path, t, q, tau):
    """An uncompressed file of a big-endian machine."""

    def element(kind, data):
        return struct.pack(">II", kind, len(data)) + data + b"\0" * (-len(data) % 8)

    def matrix(name, a):
        a = np.atleast_2d(a) if a.ndim == 2 else a.reshape(-1, 1)
        body = element(6, struct.pack(">II", 6, 0)) + element(5, struct.pack(">ii", *a.shape))
        body += element(1, name.encode()) + element(9, a.astype(">f8").tobytes("F"))
        return struct.pack(">II", 14, len(body)) + body

    head = b"MATLAB 5.0 MAT-file".ljust(124, b" ") + b"\x01\x00MI"
    path.write_bytes(head + matrix("t", t) + matrix("q", q) + matrix("tau", tau))


def main():
    t, q, dq, tau = motion()
    db3(OUT / "two.db3", t, q, dq, tau)
    for name, kind in (("none", CompressionType.NONE), ("zstd", CompressionType.ZSTD), ("lz4", CompressionType.LZ4)):
        mcap(OUT / f"two_{name}.mcap", kind, t, q, dq, tau)
    np.savez(OUT / "two.npz", t=t, q=q, dq=dq.astype("f4"), tau=tau.T.copy())
    np.savez_compressed(OUT / "two_packed.npz", t=np.round(t * 1e9).astype("i8"), q=np.asfortranarray(q), tau=tau)
    scipy.io.savemat(OUT / "two.mat", {"log": {"t": t, "q": q, "tau": tau}}, do_compression=True)
    mat_big_endian(OUT / "two_big.mat", t, q, tau)


main()
