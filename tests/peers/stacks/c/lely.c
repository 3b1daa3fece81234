/*
 * A node of Lely core for the conformance test, with the objects of the EDS: lely HOST PORT NODE FILE.eds
 */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <lely/can/net.h>
#include <lely/co/dcf.h>
#include <lely/co/dev.h>
#include <lely/co/nmt.h>

#include "hub.h"

static int transmit(const struct can_msg *sent, void *data)
{
    (void)data;
    struct hub_frame frame = { .id = (uint16_t)sent->id, .remote = (sent->flags & CAN_FLAG_RTR) != 0, .length = sent->len };
    memcpy(frame.data, sent->data, 8);
    hub_send(&frame);
    return 0;
}

static void advance(can_net_t *net)
{
    uint64_t now = hub_micros();
    struct timespec time = { .tv_sec = (time_t)(now / 1000000), .tv_nsec = (long)(now % 1000000 * 1000) };
    can_net_set_time(net, &time);
}

int main(int count, char **arguments)
{
    if (count != 5)
        return 2;
    hub_open(arguments[1], arguments[2]);
    can_net_t *net = can_net_create();
    co_dev_t *device = co_dev_create_from_dcf_file(arguments[4]);
    if (net == NULL || device == NULL || co_dev_set_id(device, (co_unsigned8_t)atoi(arguments[3])) < 0)
        return 1;
    can_net_set_send_func(net, transmit, NULL);
    advance(net);
    co_nmt_t *nmt = co_nmt_create(net, device);
    puts("running");
    fflush(stdout);
    if (nmt == NULL || co_nmt_cs_ind(nmt, CO_NMT_CS_RESET_NODE) < 0)
        return 1;
    for (;;) {
        struct hub_frame heard;
        if (hub_receive(&heard, 1)) {
            struct can_msg message = CAN_MSG_INIT;
            message.id = heard.id;
            message.flags = heard.remote ? CAN_FLAG_RTR : 0;
            message.len = heard.length;
            memcpy(message.data, heard.data, 8);
            can_net_recv(net, &message);
        }
        advance(net);
    }
}
