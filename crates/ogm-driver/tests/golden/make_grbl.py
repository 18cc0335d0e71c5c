"""Writes grbl.txt: conversations with a four-axis grblHAL, from a second account of gnea/grbl's interface.md and commands.md.

Lines: "= grbl" a fresh controller with all counters at 0 (its welcome follows); "> " a line to it; "! xx" a real-time byte in hexadecimal;
"< " its answers; "~" wait until it rests.
Run: python3 make_grbl.py > grbl.txt
"""
import re

# Travel of the simulated bench: soft limits widened by half a degree.
TRAVEL = [(-2.5, 182.5), (-185.5, 185.5), (-2.5, 182.5), (-185.5, 185.5)]
HOME = [0, 0, 180, 0]
WELCOME = "Grbl 1.1h ['$' for help]"


def dec(thousandths):
    return ("-" if thousandths < 0 else "") + f"{abs(thousandths) // 1000}.{abs(thousandths) % 1000:03}"


class Controller:
    def __init__(self):
        print("= grbl")
        self.state = "Alarm"
        self.locked = True
        self.pos = [0, 0, 0, 0]
        self.target = None
        self.settings = {10: 1000, 20: 1000, 21: 1000, 22: 1000, 130: 360000, 131: 360000, 132: 360000}
        self.out(WELCOME)

    def out(self, *lines):
        for line in lines:
            print("< " + line)

    def moving(self):
        return self.target is not None

    def report(self):
        return f"<{self.state}|MPos:{','.join(map(dec, self.pos))}|FS:0,0>"

    def outside(self, words):
        return any(not low <= HOME[i] + v / 1000 <= high for i, (v, (low, high)) in enumerate(zip(words, TRAVEL)))

    def words(self, text):
        m = re.fullmatch(r"((?:[XYZA][^A-Z]*)*)(.*)", text)
        values = []
        rest = text
        for letter in "XYZABC":
            if not rest.startswith(letter):
                break
            m = re.match(r"([^A-Za-z]*)(.*)", rest[1:])
            if not re.fullmatch(r"[+-]?[0-9]{1,9}(\.[0-9]{0,3})?", m[1]):
                return None, None
            values.append(round(float(m[1]) * 1000))
            rest = m[2]
        return values, rest

    def line(self, text):
        print("> " + text)
        error = lambda n: self.out(f"error:{n}")
        if len(text) > 79:
            return error(11)
        if text == "$I":
            return self.out("[VER:1.1h.20190825:OGM]", "[OPT:VNMH,35,255,4]", "ok")
        if text == "$$":
            if self.moving():
                return error(8)
            return self.out(*[f"${n}={dec(v)}" for n, v in sorted(self.settings.items())], "ok")
        if text == "$X":
            self.locked = False
            if self.state == "Alarm":
                self.state = "Idle"
            return self.out("[MSG:Caution: Unlocked]", "ok")
        if text == "$H":
            if self.moving():
                return error(8)
            self.locked = False
            self.state = "Home"
            self.target = [0, 0, 0, 0]
            return
        jog = text.startswith("$J=G90G21")
        rapid = text.startswith("G90G53G0")
        if jog or rapid:
            body = text[len("$J=G90G21"):] if jog else text[len("G90G53G0"):]
            values, rest = self.words(body)
            if values is None:
                return error(2)
            if not values:
                return error(26)
            if jog:
                if not rest.startswith("F"):
                    return error(22)
                if not re.fullmatch("F[0-9]+", rest):
                    return error(2)
                if int(rest[1:]) == 0:
                    return error(22)
            elif rest:
                return error(20)
            if self.locked:
                return error(9)
            if jog and self.moving():
                return error(8)
            if self.outside(values):
                if jog:
                    return error(15)
                self.state, self.locked, self.target = "Alarm", True, None
                return self.out("ALARM:2", "[MSG:Reset to continue]")
            if self.state != "Check":
                self.target = values + self.pos[len(values):]
                self.state = "Jog" if jog else "Run"
                if self.target == self.pos:
                    self.target, self.state = None, self.state
            return self.out("ok")
        known = {"$C", "$SLP", "G4P0.01"}
        m = re.fullmatch(r"M6([23])P([0-9]+)", text)
        s = re.fullmatch(r"\$([0-9]+)=(-?[0-9]+(?:\.[0-9]{0,3})?)", text)
        if text not in known and not m and not s:
            if text.startswith("$"):
                return error(2 if re.match(r"\$[0-9]+=", text) else 3)
            return error(2 if re.match("M6[23]P", text) else 20)
        if self.locked:
            return error(9)
        if text == "$C":
            if self.moving():
                return error(8)
            self.state = "Idle" if self.state == "Check" else "Check"
            return self.out("[MSG:Enabled]" if self.state == "Check" else "[MSG:Disabled]", "ok")
        if m and int(m[2]) > 3:
            return error(39)
        if s:
            if self.moving():
                return error(8)
            self.settings[int(s[1])] = round(float(s[2]) * 1000)
        self.out("ok")

    def byte(self, b):
        print(f"! {b:02x}")
        if b == 0x3F:
            if not self.moving() and self.state in ("Jog", "Run"):
                self.state = "Idle"  # a move of no length is over at once
            if self.state != "Home":
                self.out(self.report())
        elif b == 0x18:
            lost = self.moving()
            if lost:
                self.out("ALARM:6" if self.state == "Home" else "ALARM:3")
            self.locked = lost or self.locked
            self.target = None
            self.state = "Alarm" if self.locked else "Idle"
            self.out(WELCOME)

    def rest(self):
        print("~")
        if self.target is not None:
            self.pos = list(self.target)
        self.target = None
        if self.state == "Home":
            self.pos = [0, 0, 0, 0]
            self.state = "Idle"
            self.out("ok")
        elif self.state in ("Jog", "Run"):
            self.state = "Idle"


c = Controller()
c.byte(0x3F)
for text in ["$I", "G4P0.01", "$J=G90G21X1.000F100", "M62P0", "$C", "$SLP", "$10=0", "$X", "$$"]:
    c.line(text)
c.byte(0x3F)
c.line("G90G53G0X1.000Y-1.000")
c.rest()
c.line("$H")
c.byte(0x3F)
c.rest()
c.byte(0x3F)


def jog(*v, feed=1200):
    c.line("$J=G90G21" + "".join(l + dec(x) for l, x in zip("XYZA", v)) + f"F{feed}")


def go(*v):
    jog(*v)
    c.rest()
    c.byte(0x3F)


for v in [(10000, 0, 0, 0), (10000, -20000, -30000, 40000), (0, 0, 0, 0), (1, -1, -1, 1), (0, 0, 0, -5), (45000, 90000, -135000, -90000),
          (182500, 185500, -182500, -185500), (-2500, -185500, 2500, 185500), (123456 - 1, 1, -1, 7), (0, 0, 0, 0)]:
    go(*v)
for k in range(1, 13):
    go(k * 1111, -k * 777, -k * 2222, k * 3333)
go(0, 0, 0, 0)
# Outside: jog says error 15 and nothing moves.
for v in [(182501, 0, 0, 0), (-2501, 0, 0, 0), (0, 185501, 0, 0), (0, 0, 2501, 0), (0, 0, -182501, 0), (0, 0, 0, -185501)]:
    jog(*v)
    c.byte(0x3F)
# Bad lines.
for text in ["$J=G90G21F100", "$J=G90G21X1.000", "$J=G90G21X1.000F0", "$J=G90G21X1.0000F10", "$J=G90G21X--1F10", "$J=G90G21X1.000Fx", "$Q", "$", "$x=1", "$5=",
             "G1X5", "hello", "G90G53G0", "G90G53G0X1.000F5", "M62P4", "M62Px", "M99", "$J=G90G21X1.000F10" + "0" * 70, "G90G53G0X1e3"]:
    c.line(text)
c.byte(0x3F)
# Outputs, dwell, settings, check mode.
for p in range(4):
    c.line(f"M62P{p}")
    c.line(f"M63P{p}")
c.line("$130=180")
c.line("$10=1")
c.line("$$")
c.line("$C")
c.byte(0x3F)
jog(50000, 0, 0, 0)
c.byte(0x3F)
c.line("$C")
c.byte(0x3F)
# One move in flight.
jog(90000, 0, 0, 0)
jog(0, 0, 0, 0)
c.line("$H")
c.line("$$")
c.line("$10=0")
c.line("M62P1")
c.rest()
c.byte(0x3F)
c.line("G90G53G0X0.000Y0.000Z0.000A0.000")
c.rest()
c.byte(0x3F)
# Reset at rest keeps the position, reset in motion locks.
c.byte(0x18)
c.byte(0x3F)
c.line("G90G53G0X200.000")
c.byte(0x3F)
jog(0, 0, 0, 0)
c.line("$X")
jog(30000, 0, 0, 0)
c.rest()
c.byte(0x3F)
c.line("$H")
c.byte(0x18)
jog(1000, 0, 0, 0)
c.line("$H")
c.rest()
c.byte(0x3F)
go(5000, 5000, -5000, 5000)
for b in [0x21, 0x7E, 0x84, 0x85]:  # nothing to hold, resume or cancel
    c.byte(b)
    c.byte(0x3F)
