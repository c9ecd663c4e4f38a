/* A board of one axis that judges its host: docs/serial-protocol.md read by somebody else, in another language.
 *
 *   board LINK OBSERVED RATE_HZ
 *
 * A pseudo-terminal appears under LINK. OBSERVED is a ring of what the motor got in each cycle (hw/simulators/serial_observation.py). It
 * has a watchdog of its own and writes down, for as long as it lives, the longest time for which torque stayed on without a fresh
 * command. SIGTERM: it says that in one line of JSON and ends.
 */
#define _GNU_SOURCE
#include <errno.h>
#include <fcntl.h>
#include <math.h>
#include <signal.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <termios.h>
#include <time.h>
#include <unistd.h>

enum { CAPACITY = 32768, LONGEST = 256, STATE_BYTES = 38, IDENTITY_BYTES = 28, COMMAND_BYTES = 12 };
enum { ENABLED = 1, EXPIRED = 8, DAMAGED = 16, HELD = 128 };
enum { STATE = 0x01, IDENTITY = 0x02, COMMAND = 0x81, STOP = 0x82, IDENTIFY = 0x83 };

static const double INERTIA = 0.012, VISCOUS = 0.05, DRY = 0.01, NM_PER_A = 80.0 * 0.72 * 0.0134, COUNTS = 160000.0;

struct header { int64_t count, n_axes, capacity; };
struct row {
    int64_t time_ns, slot, enabled, status, command_sequence, command_age;
    double current_a, torque_nm, position_rad;
};

static struct {
    int held, expired, damaged, enable, torque_mode, time_to_live;
    uint16_t command_sequence, state_sequence;
    int64_t age, value, fresh_ns;
} board = {.held = 1, .age = 255, .time_to_live = 1};

static struct { int64_t longest_ns, longest_cycles, commands, stops; } judged;
static volatile sig_atomic_t over;
static int line;
static unsigned period_us;

static void end(int number) { (void)number; over = 1; }

static int64_t now_ns(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return t.tv_sec * 1000000000LL + t.tv_nsec;
}

static uint32_t crc32(const uint8_t *data, int n)
{
    uint32_t rest = 0xFFFFFFFFu;
    for (int i = 0; i < n; i++) {
        rest ^= data[i];
        for (int bit = 0; bit < 8; bit++)
            rest = rest >> 1 ^ (rest & 1 ? 0xEDB88320u : 0);
    }
    return ~rest;
}

static void put(uint8_t *at, int size, uint64_t value)
{
    for (int k = 0; k < size; k++)
        at[k] = (uint8_t)(value >> 8 * k);
}

static uint32_t get(const uint8_t *at, int size)
{
    uint32_t value = 0;
    for (int k = 0; k < size; k++)
        value |= (uint32_t)at[k] << 8 * k;
    return value;
}

/* 00 COBS(body CRC) 00; the body has room for its CRC. What the line has no room for is dropped. */
static void send_packet(uint8_t *body, int n)
{
    uint8_t packet[LONGEST] = {0};
    int at = 2, code_at = 1, code = 1;
    put(body + n, 4, crc32(body, n));
    for (int i = 0; i < n + 4; i++) {
        if (body[i]) {
            packet[at++] = body[i];
            code++;
        } else {
            packet[code_at] = (uint8_t)code;
            code_at = at++;
            code = 1;
        }
    }
    packet[code_at] = (uint8_t)code;
    packet[at] = 0;
    if (write(line, packet, (size_t)at + 1) < 0)
        errno = 0;
}

/* The body between two delimiters, without its CRC; -1 for anything else. */
static int unpack(const uint8_t *data, int n, uint8_t *body)
{
    int at = 0;
    for (int i = 0; i < n;) {
        int code = data[i];
        if (code == 0 || i + code > n)
            return -1;
        memcpy(body + at, data + i + 1, (size_t)code - 1);
        at += code - 1;
        i += code;
        if (i < n)
            body[at++] = 0;
    }
    if (at < 8 || crc32(body, at - 4) != get(body + at - 4, 4))
        return -1;
    return at - 4;
}

static void hold(void) { board.held = 1; board.enable = 0; board.value = 0; }

static void obey(const uint8_t *body)
{
    uint16_t sequence = (uint16_t)get(body + 2, 2), ahead = (uint16_t)(sequence - board.command_sequence);
    int enable = body[4] & 1;
    if (!enable)
        board.held = board.expired = 0;
    else if (board.held || ahead == 0 || ahead >= 0x8000)
        return;
    board.enable = enable;
    board.torque_mode = body[4] >> 1 & 1;
    board.time_to_live = body[5];
    board.value = (int32_t)get(body + 8, 4);
    board.command_sequence = sequence;
    board.age = 0;
    board.fresh_ns = now_ns();
    judged.commands++;
}

static void identify(const uint8_t *request)
{
    uint8_t body[IDENTITY_BYTES + 4] = {1, IDENTITY, request[2], request[3], 1};
    put(body + 6, 2, 1);
    put(body + 8, 4, period_us);
    memcpy(body + 12, "JUDGE-C", 7);
    send_packet(body, IDENTITY_BYTES);
}

static void take(const uint8_t *data, int n)
{
    uint8_t body[LONGEST];
    int length = unpack(data, n, body);
    if (length < 0)
        board.damaged = 1;
    else if (body[0] != 1)
        return;
    else if (length == COMMAND_BYTES && body[1] == COMMAND && body[6] == 1 && body[5])
        obey(body);
    else if (length == 4 && body[1] == STOP) {
        hold();
        judged.stops++;
    } else if (length == 4 && body[1] == IDENTIFY)
        identify(body);
}

static void listen(void)
{
    static uint8_t pending[LONGEST];
    static int n;
    uint8_t chunk[4096];
    ssize_t got;
    while ((got = read(line, chunk, sizeof chunk)) > 0)
        for (ssize_t i = 0; i < got; i++) {
            if (chunk[i] == 0) {
                if (n)
                    take(pending, n < LONGEST ? n : LONGEST - 1);
                n = 0;
            } else if (n < LONGEST)
                pending[n++] = chunk[i];
        }
}

static int status(int enabled)
{
    return (enabled ? ENABLED : 0) | (board.expired ? EXPIRED : 0) | (board.damaged ? DAMAGED : 0) | (board.held ? HELD : 0);
}

static void report(int64_t slot, double position, double current, int enabled)
{
    uint8_t body[STATE_BYTES + 4] = {1, STATE};
    put(body + 2, 2, board.state_sequence++);
    put(body + 4, 4, (uint64_t)(slot * period_us));
    put(body + 8, 2, (uint64_t)status(enabled));
    put(body + 10, 2, board.command_sequence);
    body[12] = (uint8_t)(board.age < 255 ? board.age : 255);
    body[13] = 1;
    put(body + 28, 4, (uint64_t)llrint(position / (2 * M_PI) * COUNTS));
    put(body + 32, 4, (uint64_t)llrint(current * 1e6));
    put(body + 36, 2, 2500);
    send_packet(body, STATE_BYTES);
    board.damaged = 0;
}

static void judge(double torque)
{
    int64_t silent = now_ns() - board.fresh_ns;
    if (torque == 0.0)
        return;
    if (silent > judged.longest_ns)
        judged.longest_ns = silent;
    if (board.age > judged.longest_cycles)
        judged.longest_cycles = board.age;
}

static void move(double torque, double *position, double *speed)
{
    double dt = period_us * 1e-6 / 10;
    for (int i = 0; i < 10; i++) {
        *speed += dt / INERTIA * (torque - VISCOUS * *speed - DRY * tanh(*speed / 0.01));
        *position += dt * *speed;
    }
}

static void *observe(const char *path)
{
    size_t size = sizeof(struct header) + CAPACITY * sizeof(struct row);
    int fd = open(path, O_RDWR | O_CREAT | O_TRUNC, 0600);
    if (fd < 0 || ftruncate(fd, (off_t)size))
        exit(2);
    struct header *made = mmap(NULL, size, PROT_READ | PROT_WRITE, MAP_SHARED, fd, 0);
    if (made == MAP_FAILED)
        exit(2);
    made->n_axes = 1;
    made->capacity = CAPACITY;
    return made;
}

static void plug(const char *link)
{
    struct termios raw;
    line = posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK);
    if (line < 0 || grantpt(line) || unlockpt(line))
        exit(3);
    int kept = open(ptsname(line), O_RDWR | O_NOCTTY); /* a host that closes is no hang-up for the board */
    if (kept < 0 || tcgetattr(kept, &raw))
        exit(3);
    cfmakeraw(&raw);
    if (tcsetattr(kept, TCSANOW, &raw) || symlink(ptsname(line), link))
        exit(3);
}

int main(int argc, char **argv)
{
    if (argc != 4)
        return 1;
    double position = 0, speed = 0;
    int64_t slot = 0;
    period_us = (unsigned)(1000000 / atoi(argv[3]));
    struct header *header = observe(argv[2]);
    struct row *rows = (struct row *)(header + 1);
    plug(argv[1]);
    signal(SIGTERM, end);
    printf("ready\n");
    fflush(stdout);
    int64_t began = now_ns();
    pid_t parent = getppid();
    while (!over && getppid() == parent) {
        int64_t due = began + (slot + 1) * 1000 * period_us;
        struct timespec until = {due / 1000000000, due % 1000000000};
        clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &until, NULL);
        int64_t cycles = (now_ns() - began) / (1000 * period_us) - slot; /* more than one where the machine stood still */
        if (cycles < 1)
            continue;
        listen();
        slot += cycles;
        board.age += cycles;
        if (board.age >= board.time_to_live && !board.expired) {
            board.expired = 1;
            hold();
        }
        int enabled = board.enable && !board.held;
        double value = enabled ? board.value * 1e-6 : 0.0, current = board.torque_mode ? value / NM_PER_A : value;
        judge(current);
        move(current * NM_PER_A, &position, &speed);
        report(slot, position, current, enabled);
        rows[header->count % CAPACITY] = (struct row){now_ns(), slot, enabled, status(enabled), board.command_sequence,
                                                      board.age, current, current * NM_PER_A, position};
        __atomic_store_n(&header->count, header->count + 1, __ATOMIC_RELEASE);
    }
    printf("{\"longest_ns\": %lld, \"longest_cycles\": %lld, \"commands\": %lld, \"stops\": %lld}\n", (long long)judged.longest_ns,
           (long long)judged.longest_cycles, (long long)judged.commands, (long long)judged.stops);
    return 0;
}
