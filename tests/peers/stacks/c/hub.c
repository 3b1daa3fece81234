#define _GNU_SOURCE
#include "hub.h"

#include <netdb.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>

static int bus = -1;
static char text[1 << 16];
static size_t filled;

static void fail(const char *what)
{
    perror(what);
    exit(1);
}

/* Reads what is there within so many milliseconds. */
static void fill(int wait_ms)
{
    struct pollfd waits = { .fd = bus, .events = POLLIN };
    if (poll(&waits, 1, wait_ms) <= 0)
        return;
    ssize_t count = read(bus, text + filled, sizeof text - 1 - filled);
    if (count <= 0)
        exit(0);
    filled += (size_t)count;
    text[filled] = 0;
}

/* Takes the next "< .. >" out of the text; 0 if none is whole. */
static int take(char *words, size_t size)
{
    char *end = memchr(text, '>', filled);
    if (end == NULL)
        return 0;
    size_t length = (size_t)(end + 1 - text);
    snprintf(words, size, "%.*s", (int)length, text);
    memmove(text, end + 1, filled - length + 1);
    filled -= length;
    return 1;
}

void hub_open(const char *host, const char *port)
{
    struct addrinfo hints = { .ai_socktype = SOCK_STREAM }, *found;
    if (getaddrinfo(host, port, &hints, &found) != 0)
        fail("getaddrinfo");
    bus = socket(found->ai_family, found->ai_socktype | SOCK_CLOEXEC, found->ai_protocol);
    if (bus < 0 || connect(bus, found->ai_addr, found->ai_addrlen) < 0)
        fail("connect");
    freeaddrinfo(found);
    int on = 1;
    setsockopt(bus, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
    static const char *const commands[] = { "< open can0 >", "< rawmode >", "" };
    for (int step = 0; step < 3; step++) {
        char words[256];
        while (!take(words, sizeof words))
            fill(-1);
        if (write(bus, commands[step], strlen(commands[step])) < 0)
            fail("write");
    }
}

int hub_receive(struct hub_frame *frame, int wait_ms)
{
    char words[256], kind[8], digits[32];
    unsigned id;
    if (memchr(text, '>', filled) == NULL)
        fill(wait_ms);
    while (take(words, sizeof words)) {
        digits[0] = 0;
        if (sscanf(words, " < %7s %x %*s %31[0-9A-Fa-f]", kind, &id, digits) < 2 || id > 0x7FF)
            continue;
        frame->remote = strcmp(kind, "rtr") == 0;
        if (!frame->remote && strcmp(kind, "frame") != 0)
            continue;
        frame->id = (uint16_t)id;
        frame->length = (uint8_t)(frame->remote ? strtoul(digits, NULL, 10) : strlen(digits) / 2);
        for (int at = 0; !frame->remote && at < frame->length; at++)
            sscanf(digits + 2 * at, "%2hhx", &frame->data[at]);
        return 1;
    }
    return 0;
}

void hub_send(const struct hub_frame *frame)
{
    char line[80];
    int length = snprintf(line, sizeof line, frame->remote ? "< sendrtr %X %u" : "< send %X %u", frame->id, frame->length);
    for (int at = 0; !frame->remote && at < frame->length; at++)
        length += snprintf(line + length, sizeof line - (size_t)length, " %02X", frame->data[at]);
    length += snprintf(line + length, sizeof line - (size_t)length, " >");
    if (write(bus, line, (size_t)length) != length)
        exit(0);
}

uint64_t hub_micros(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (uint64_t)now.tv_sec * 1000000u + (uint64_t)now.tv_nsec / 1000u;
}
