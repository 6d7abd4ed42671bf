#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""An arm in another language: what a program must do to be a haptic arm of Catgut over the bridge (src/device/bridge_packet.h has
the packets). Here the "arm" is a point of 0.1 kg on a spring, moved by the force that it computes; put your encoders and motors in
its place, and keep the order in render(): expiry, cap, ramp, slew. A hand is at the other end.
   python3 samples/bridge_arm.py [PORT]   then   catgut play SCENE --haptics bridge      (loopback only: it uses no key)"""
import ctypes, ctypes.util, hashlib, os, socket, struct, sys, time

sodium = ctypes.CDLL(ctypes.util.find_library("sodium") or "libsodium.so.23")
assert sodium.sodium_init() >= 0
KEY = bytes(32)  # shared by both ends; 32 zero bytes on the loopback
HELLO, COOKIE, OPEN, OPENED, REFUSED, ASK, INFO, SAMPLE, PATCH, BYE = range(1, 11)
CAP, SLEW, RAMP, EXPIRY, OFF_AFTER = 3.3, 0.5, 2.0, 0.03, 0.06  # [N], [N/ms], [s], [s], [s]

def blake(data, size=32): return hashlib.blake2b(data, digest_size=size, key=KEY).digest()
def head(kind, arm, counter): return struct.pack("<IHBBQ", 0x42474143, 2, kind, arm, counter)
def shake(kind, *parts):
    packet = (head(kind, 0, 0) + b"".join(parts)).ljust(240, b"\0")
    return packet + blake(packet, 16)
def nonce(counter): return bytes(16) + struct.pack("<Q", counter)
def seal(key, kind, arm, counter, payload):
    h, out = head(kind, arm, counter), ctypes.create_string_buffer(240)
    sodium.crypto_aead_xchacha20poly1305_ietf_encrypt(out, None, payload.ljust(224, b"\0"), ctypes.c_ulonglong(224), h,
                                                      ctypes.c_ulonglong(16), None, nonce(counter), key)
    return h + out.raw
def unseal(key, packet):
    out, counter = ctypes.create_string_buffer(224), struct.unpack_from("<Q", packet, 8)[0]
    wrong = sodium.crypto_aead_xchacha20poly1305_ietf_decrypt(out, None, None, packet[16:], ctypes.c_ulonglong(240), packet[:16],
                                                              ctypes.c_ulonglong(16), nonce(counter), key)
    return None if wrong else out.raw

class Session:  # started by an open with a valid cookie
    def __init__(self, peer, caller, cookie):
        secret, own, shared = os.urandom(32), ctypes.create_string_buffer(32), ctypes.create_string_buffer(32)
        sodium.crypto_scalarmult_base(own, secret)
        wrong = sodium.crypto_scalarmult(shared, secret, caller)
        text = (os.urandom(32) if wrong else shared.raw) + caller + own.raw + cookie
        self.peer, self.own, self.into, self.out = peer, own.raw, blake(text + b"\1"), blake(text + b"\2")
        self.sent, self.last, self.heard = 0, {}, 0.0
    def send(self, kind, arm, payload):
        self.sent += 1
        sock.sendto(seal(self.out, kind, arm, self.sent, payload), self.peer)

class Force:  # on the right hand, along x, at 1 kHz
    def __init__(self): self.patch, self.got, self.out, self.part, self.quiet = None, 0.0, 0.0, 0.0, 0
    def render(self, x, now):
        wanted, age = 0.0, now - self.got
        if self.patch and age < EXPIRY + OFF_AFTER:
            point, force, stiff, normal, gap, cap = self.patch
            wanted = force + stiff * (point - x)
            if normal and normal * (x - point) >= gap: wanted = 0.0     # the tool has left the tissue
            elif normal: wanted = normal * max(0.0, wanted * normal)    # tissue only pushes
            wanted = max(-cap, min(cap, wanted))
            if abs(x - point) > 0.02: wanted, self.part = 0.0, 0.0      # the patch belongs to another position
            if age > EXPIRY: wanted *= 2.718 ** -((age - EXPIRY) / 0.02)  # not renewed: it fades
        else: self.part = 0.0
        if self.part == 0.0:  # engage only at zero force; then over two seconds
            self.quiet = self.quiet + 1 if self.patch and abs(wanted) < 0.2 and age < EXPIRY else 0
            if self.quiet > 3: self.part = 0.001 / RAMP
        elif self.part < 1.0: self.part = min(1.0, self.part + 0.001 / RAMP)
        wanted = max(-CAP, min(CAP, wanted)) * self.part
        self.out += max(-SLEW, min(SLEW, wanted - self.out))  # per call: a late call does not get a larger step
        return self.out

sock = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
sock.bind(("127.0.0.1", int(sys.argv[1]) if len(sys.argv) > 1 else 26720))
sock.setblocking(False)
print("listening on port", sock.getsockname()[1], flush=True)
secret, session, felt, place, speed = os.urandom(32), None, Force(), 0.02, 0.0
def cookie(caller, peer): return hashlib.blake2b(caller + repr(peer).encode(), digest_size=32, key=secret).digest()

while True:
    now = time.monotonic()
    try:
        while True:
            packet, sender = sock.recvfrom(512)
            if len(packet) != 256: continue
            magic, version, kind, arm, counter = struct.unpack_from("<IHBBQ", packet)
            if magic != 0x42474143 or version != 2: continue
            if kind <= REFUSED:
                if blake(packet[:240], 16) != packet[240:]: continue
                caller = packet[16:48]
                if kind == HELLO: sock.sendto(shake(COOKIE, caller, cookie(caller, sender)), sender)
                if kind == OPEN and packet[48:80] == cookie(caller, sender):
                    # One simulator at a time. A repeated open does not start a second session (a new cookie secret voids it).
                    if session and now < session.heard + 1 and sender != session.peer: continue
                    session, felt.patch, secret = Session(sender, caller, packet[48:80]), None, os.urandom(32)
                    sock.sendto(shake(OPENED, caller, session.own), sender)
                continue
            if not session or sender != session.peer or counter <= session.last.get((kind, arm), 0): continue
            payload = unseal(session.into, packet)
            if payload is None: continue
            session.last[kind, arm], session.heard = counter, now
            if kind == ASK:
                names = b"".join(text.ljust(40, b"\0") for text in (b"Python's arm", b"spring", b"py-1", b"bridge_arm.py"))
                session.send(INFO, 0, struct.pack("<I10f", 1, 3.3, 0.88, 400, 4, -.1, -.1, -.1, .1, .1, .1) + names)
                session.send(INFO, 1, b"")  # there is no left arm
            elif kind == PATCH and arm == 0:  # only its x component; a real device uses all three directions
                f = struct.unpack_from("<37f", payload, 24)
                age = now - 1e-9 * struct.unpack_from("<Q", payload, 0)[0]
                if 0 <= age < 0.15: felt.patch, felt.got = (f[2], f[5], min(400, f[8]), f[20], f[23], f[36]), now
            elif kind == BYE: session, felt.patch = None, None
    except BlockingIOError: pass
    force = felt.render(place, now)
    speed += 0.001 * (force + 20 * (0.02 - place) - speed) / 0.1
    place += 0.001 * speed
    if session and now < session.heard + 0.2:  # a silent simulator gets no further samples
        session.send(SAMPLE, 0, struct.pack("<QII14fIf", int(now * 1e9), 1, 0, place, 0, 0, 0, 0, 0, 1, speed, 0, 0, 0,
                                            force, 0, 0, 0, -1))
    time.sleep(0.001)
