/* A socketcand server as the bus of a stack in C. The program ends with the connection. */
#ifndef HUB_H
#define HUB_H

#include <stdint.h>

/* A frame with an identifier of 11 bits. */
struct hub_frame {
    uint16_t id;
    uint8_t remote;
    uint8_t length;
    uint8_t data[8];
};

/* Opens the bus. */
void hub_open(const char *host, const char *port);
/* Waits so many milliseconds for a frame; 0 without one. */
int hub_receive(struct hub_frame *frame, int wait_ms);
void hub_send(const struct hub_frame *frame);
/* Microseconds of a clock that goes on evenly. */
uint64_t hub_micros(void);

#endif
