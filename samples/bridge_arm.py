#!/usr/bin/env python3
"""An arm in another language: what a program must do to be a haptic arm of Catgut over the bridge (the layout of the packets is
in src/device/bridge.h). Here the "arm" is a point of 0.1 kg on a spring, moved by the force that comes back; put your encoders and
motors in its place.   python3 samples/bridge_arm.py [PORT]   then   catgut play SCENE --haptics bridge"""
import socket, struct, sys, time, zlib

sock = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
sock.bind(("127.0.0.1", int(sys.argv[1]) if len(sys.argv) > 1 else 26720))
sock.setblocking(False)
print("listening on port", sock.getsockname()[1], flush=True)
HEAD = "<IHBBQQQ"  # magic, version, kind, arm, session, sequence, time
sequence, peer, session, place, speed, force, good_until = 0, None, 0, 0.02, 0.0, 0.0, 0.0

def send(kind, arm, payload, to):
    global sequence
    sequence += 1
    packet = (struct.pack(HEAD, 0x42474143, 1, kind, arm, session, sequence, time.monotonic_ns()) + payload).ljust(252, b"\0")
    sock.sendto(packet + struct.pack("<I", zlib.crc32(packet)), to)

while True:
    now = time.monotonic()
    try:
        while True:
            packet, sender = sock.recvfrom(512)
            if len(packet) != 256 or struct.unpack_from("<I", packet, 252)[0] != zlib.crc32(packet[:252]): continue
            magic, version, kind, arm, theirs, _, _ = struct.unpack_from(HEAD, packet)
            if magic != 0x42474143 or version != 1: continue
            if kind == 1:  # hello: the right hand is here, there is no left one
                peer, session, force = sender, theirs, 0.0
                names = b"".join(text.ljust(40, b"\0") for text in (b"Python's arm", b"spring", b"py-1", b"bridge_arm.py"))
                send(2, 0, struct.pack("<I10f", 1, 3.3, 0.88, 400, 4, -.1, -.1, -.1, .1, .1, .1) + names, peer)
                send(2, 1, b"", peer)
            elif kind == 4 and sender == peer and theirs == session:  # a force: for 20 ms after the sample that it answers
                force, _, _, expiry, answers = struct.unpack_from("<4fQ", packet, 32)
                good_until = answers * 1e-9 + min(expiry, 0.02)
            elif kind == 6: peer = None
    except BlockingIOError: pass
    if now > good_until: force = 0.0  # the watchdog; a real arm lets it fade (at most 0.5 N a millisecond)
    speed += 0.001 * (force + 20 * (0.02 - place) - speed) / 0.1
    place += 0.001 * speed
    if peer: send(3, 0, struct.pack("<IIfff4f3ff3f", 1, 0, place, 0, 0, 0, 0, 0, 1, speed, 0, 0, 0, force, 0, 0), peer)
    time.sleep(0.001)
