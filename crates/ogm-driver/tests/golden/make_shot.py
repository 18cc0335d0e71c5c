"""Writes shot.txt: conversations with SIGMA KOKI controllers, from a second, independent account of their grammar (see protocol/shot/mod.rs for the sources).

Lines: "= model" a fresh controller with all counters at 0; "> " to it; "< " its answers; "~" wait until it rests.
Run: python3 make_shot.py > shot.txt
"""
import re

NAMES = {"shot302": ("SHOT-302GS", 2), "shot304": ("SHOT-304GS", 4), "shot702": ("SHOT-702", 2), "gsc01": ("GSC-01", 1), "gsc02": ("GSC-02", 2)}
# Limit sensors of the simulated bench in pulses, by axis.
SENSORS = [(-1200, 73200), (-74400, 74400), (-73200, 1200), (-74400, 74400)]
DIVISIONS = [1, 2, 4, 5, 8, 10, 20, 25, 40, 50, 80, 100, 125, 200, 250]
count = 0


class Controller:
    def __init__(self, key):
        self.key = key
        self.name, self.n = NAMES[key]
        self.mute = key == "gsc02"
        self.pos = [0] * self.n
        self.zero = [0] * self.n
        self.next = None
        self.hold = [True] * self.n
        self.speed = [(500, 5000, 200)] * self.n
        self.div = [2] * self.n
        self.ack1 = "K"
        self.limit = [False] * self.n
        self.moving = False
        print(f"= {key}")

    def q(self):
        fields = [("-" if p < 0 else " ") + str(abs(p)).rjust(9) for p in self.pos]
        mask = sum(1 << i for i, l in enumerate(self.limit) if l)
        if mask == 0:
            a2 = "K"
        elif self.n == 1:
            a2 = "L"
        elif self.n == 2:
            a2 = " LMW"[mask]
        else:
            a2 = "W" if mask == 15 else f"{mask:X}"
        return ",".join(fields + [self.ack1, a2, "B" if self.moving else "R"])

    def axes(self, w):
        return list(range(self.n)) if w == "W" else [int(w) - 1]

    def accept(self, line):
        if line == ("G" if self.mute else "G:"):
            if self.moving or self.next is None:
                return False
            for i, t in self.next.items():
                low, high = SENSORS[i]
                real = t + self.zero[i]
                self.limit[i] = not low <= real <= high
                self.target = getattr(self, "target", {})
                self.target[i] = min(max(real, low), high) - self.zero[i]
            self.moving = any(self.target[i] != self.pos[i] for i in self.next)
            self.next = None
            return True
        if line == "L:E" or line == "L:W":
            return True
        which = f"[1-{self.n}W]"
        m = re.fullmatch(f"L:({which})", line)
        if m:
            return True
        if self.moving:
            return False
        m = re.fullmatch(f"([AM]):({which})((?:[+-]P[0-9]{{1,9}})+)", line)
        if m:
            if m[1] == "A" and self.mute:
                return False
            axes = self.axes(m[2])
            values = [int(s.replace("P", "")) for s in re.findall(r"[+-]P[0-9]+", m[3])]
            if len(values) != len(axes) or not all(self.hold[a] for a in axes):
                return False
            if m[1] == "M" and self.key.startswith("gsc") and any(abs(v) > 16777214 for v in values):
                return False
            new = {a: v + (self.pos[a] if m[1] == "M" else 0) for a, v in zip(axes, values)}
            if any(abs(v) > 999999999 for v in new.values()):
                return False
            self.next = new
            return True
        m = re.fullmatch(f"J:({which})([+-]+)", line)
        if m:
            axes = self.axes(m[1])
            if len(m[2]) != len(axes) or not all(self.hold[a] for a in axes):
                return False
            self.next = {a: (268435455 if c == "+" else -268435455) for a, c in zip(axes, m[2])}
            return True
        m = re.fullmatch(f"H:({which})([+-]*)", line)
        if m:
            axes = self.axes(m[1])
            if len(m[2]) != (len(axes) if self.key.startswith("gsc") else 0):
                return False
            for a in axes:
                self.zero[a] = 0
                self.pos[a] = 0
                self.limit[a] = False
            self.next = None
            self.homing = True
            return True
        m = re.fullmatch(f"R:({which})", line)
        if m:
            for a in self.axes(m[1]):
                self.zero[a] += self.pos[a]
                self.pos[a] = 0
            return True
        m = re.fullmatch(f"D:({which})((?:S[0-9]+F[0-9]+R[0-9]+)+)", line)
        if m:
            axes = self.axes(m[1])
            values = [tuple(map(int, v)) for v in re.findall(r"S([0-9]+)F([0-9]+)R([0-9]+)", m[2])]
            ok = len(values) == len(axes) and all(1 <= s <= f <= 500000 and r <= 1000 and (f < 8000 or s >= 64) for s, f, r in values)
            if ok:
                for a, v in zip(axes, values):
                    self.speed[a] = v
            return ok
        m = re.fullmatch(f"S:([1-{self.n}])([0-9]+)", line)
        if m:
            if int(m[2]) in DIVISIONS:
                self.div[int(m[1]) - 1] = int(m[2])
                return True
            return False
        m = re.fullmatch(f"C:({which})([01])", line)
        if m:
            for a in self.axes(m[1]):
                self.hold[a] = m[2] == "1"
            return True
        m = re.fullmatch("O:([0-9]+)", line)
        if m:
            return int(m[1]) <= 15
        return False

    def say(self, line):
        global count
        count += 1
        print("> " + line)
        answers = {
            "?:N": self.name,
            "?:V": "V1.00",
            "?:PW": ",".join(["1"] * self.n),
            "?:SW": ",".join(map(str, self.div)),
            "?:DW": ",".join(f"S{s}F{f}R{r}" for s, f, r in self.speed),
            "I:": "0",
            "!:": "B" if self.moving else "R",
            "Q:": self.q(),
        }
        if line in answers:
            answer = answers[line]
        else:
            ok = self.accept(line)
            self.ack1 = "K" if ok else "X"
            answer = None if self.mute else ("OK" if ok else "NG")
        if answer is not None:
            count += 1
            print("< " + answer)

    def rest(self):
        print("~")
        if self.moving:
            for i, t in self.target.items():
                self.pos[i] = t
            self.target = {}
            self.moving = False

    def move(self, line):
        self.say(line)
        self.say("G" if self.mute else "G:")
        self.rest()
        self.say("Q:")


for key in NAMES:
    c = Controller(key)
    n = c.n
    w = lambda values: "".join(f"{'-' if v < 0 else '+'}P{abs(v)}" for v in values)
    for ask in ["?:N", "?:V", "?:PW", "?:SW", "?:DW", "I:", "Q:", "!:", "?:X", "Q", "Q:1", "", "X:"]:
        if ask:
            c.say(ask)
    c.say("G" if c.mute else "G:")  # nothing set
    c.say("G:" if c.mute else "G")  # the other family's word
    c.move("M:1+P100")
    c.move("M:1-P350")
    c.move("M:W" + w([10, -20, -30, 40][:n]))
    c.move("A:1+P2000")
    c.move("A:W" + w([14000, -14000, -72000, 1][:n]))
    c.move("A:W" + w([0] * n))
    c.say("A:W" + w([1] * (n + 1)))
    c.say(f"M:{n + 1}+P1")
    c.say("M:1+1")
    c.say("M:1P1")
    c.say("M:1+P")
    c.say("M:1+P16777214")
    c.say("M:1+P16777215")
    c.say("A:1+P999999999")
    c.say("A:1+P1000000000")
    c.say("L:1")
    c.say("L:W")
    c.say("L:E")
    c.say(f"L:{n + 1}")
    c.say("D:1S100F1000R100")
    c.say("D:1S0F1000R100")
    c.say("D:1S64F8000R0")
    c.say("D:1S63F8000R0")
    c.say("D:1S600F500R0")
    c.say("D:1S1F500001R0")
    c.say("D:1S500F5000R1001")
    c.say("D:W" + "S500F5000R200" * n)
    c.say("D:W" + "S500F5000R200" * (n + 1))
    c.say("?:DW")
    c.say("S:12")
    c.say("S:13")
    c.say("S:1250")
    c.say("?:SW")
    c.say("C:10")
    c.say("M:1+P5")
    c.say("C:11")
    c.say("C:12")
    c.say("O:0")
    c.say("O:15")
    c.say("O:16")
    c.say("J:1+")
    c.say("L:1")
    c.say("J:1")
    c.move("M:1+P500")
    c.say("R:1")
    c.say("Q:")
    c.move("M:1-P500")
    c.say("H:1" + ("+" if key.startswith("gsc") else ""))
    c.rest()
    c.say("Q:")
    c.say("H:W" + ("-" * n if key.startswith("gsc") else ""))
    c.rest()
    c.say("Q:")
    c.say("H:W" + ("" if key.startswith("gsc") else "+" * n))
    # Moving: only stop, status and questions are taken.
    c.say("M:1+P20000")
    c.say("G" if c.mute else "G:")
    c.say("!:")
    c.say("M:1+P5")
    c.say("O:1")
    c.say("?:N")
    c.rest()
    c.say("!:")
    c.say("Q:")
    # Into the limit sensor.
    c.move("M:1+P100000")
    if n >= 2:
        c.move("M:2-P100000")
    if n == 4:
        c.move("M:W+P100000-P100000-P100000+P100000")
    c.move("M:1-P10")
