/*
 * 64 KiB in blocks between an SDO client and a server of Lely core: lely_blocks download|upload TRANSFERS
 *
 * Prints the processor time of one transfer in nanoseconds, both sides together; then the bits of its frames on the wire, and
 * the bits of its data in segments of blocks alone.
 */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include <lely/can/net.h>
#include <lely/co/csdo.h>
#include <lely/co/dcf.h>
#include <lely/co/dev.h>
#include <lely/co/ssdo.h>
#include <lely/co/val.h>

enum { LENGTH = 1 << 16, NODE = 9, QUEUED = 512 };

static const char sheet[] =
    "[FileInfo]\nFileName=box.eds\n[DeviceInfo]\nVendorName=None\nProductName=Box\n"
    "[MandatoryObjects]\nSupportedObjects=0\n[OptionalObjects]\nSupportedObjects=1\n1=0x1F50\n"
    "[ManufacturerObjects]\nSupportedObjects=0\n"
    "[1F50]\nParameterName=Program data\nObjectType=0x8\nSubNumber=2\n"
    "[1F50sub0]\nParameterName=n\nDataType=0x5\nAccessType=ro\nDefaultValue=1\n"
    "[1F50sub1]\nParameterName=Program\nDataType=0xF\nAccessType=rw\n";

static uint8_t data[LENGTH];
static struct can_msg queue[QUEUED];
static unsigned first, last;
static unsigned long bits;
static int done, counting;

static unsigned long bits_of(const struct can_msg *frame)
{
    /* With the three bits between frames, in this library's way of counting. */
    return (unsigned long)can_msg_bits(frame, CAN_MSG_BITS_MODE_EXACT);
}

/* The bits of the data in segments, seven bytes in each. */
static unsigned long bits_of_data(uint32_t id)
{
    unsigned long sum = 0;
    for (int at = 0; at < LENGTH; at += 7) {
        struct can_msg frame = CAN_MSG_INIT;
        frame.id = id;
        frame.len = 8;
        frame.data[0] = (uint8_t)(at / 7 % 127 + 1);
        memcpy(frame.data + 1, data + at, (size_t)(LENGTH - at < 7 ? LENGTH - at : 7));
        sum += bits_of(&frame);
    }
    return sum;
}

static int transmit(const struct can_msg *frame, void *unused)
{
    (void)unused;
    if (counting)
        bits += bits_of(frame);
    queue[last++ % QUEUED] = *frame;
    return 0;
}

static void confirmed(co_csdo_t *client, co_unsigned16_t index, co_unsigned8_t sub_index, co_unsigned32_t code, void *unused)
{
    (void)client, (void)index, (void)sub_index, (void)unused;
    if (code != 0) {
        fprintf(stderr, "abort %08X\n", (unsigned)code);
        exit(1);
    }
    done = 1;
}

static void received(co_csdo_t *client, co_unsigned16_t index, co_unsigned8_t sub_index, co_unsigned32_t code,
                     const void *bytes, size_t size, void *unused)
{
    if (code == 0 && (size != LENGTH || memcmp(bytes, data, LENGTH) != 0)) {
        fputs("other bytes were read\n", stderr);
        exit(1);
    }
    confirmed(client, index, sub_index, code, unused);
}

static void transfer(can_net_t *net, co_csdo_t *client, int up)
{
    done = 0;
    int failed = up ? co_csdo_blk_up_req(client, 0x1F50, 1, 0, received, NULL)
                    : co_csdo_blk_dn_req(client, 0x1F50, 1, data, LENGTH, confirmed, NULL);
    if (failed < 0)
        exit(1);
    while (first != last) {
        struct can_msg frame = queue[first++ % QUEUED];
        can_net_recv(net, &frame);
    }
}

static double processor_ns(void)
{
    struct timespec now;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
    return (double)now.tv_sec * 1e9 + (double)now.tv_nsec;
}

int main(int count, char **arguments)
{
    if (count != 3)
        return 2;
    /* The bytes of tests/tests/it/sdo_figures.rs. */
    for (uint32_t at = 0; at < LENGTH; at++)
        data[at] = (uint8_t)(at * 0x9E3779B1u >> 13);
    can_net_t *net = can_net_create();
    co_dev_t *device = co_dev_create_from_dcf_text(sheet, sheet + sizeof sheet, NULL);
    if (net == NULL || device == NULL || co_dev_set_id(device, NODE) < 0)
        return 1;
    can_net_set_send_func(net, transmit, NULL);
    co_ssdo_t *server = co_ssdo_create(net, device, 1);
    /* A client without a device of its own has the default identifiers of the server with its number. */
    co_csdo_t *client = co_csdo_create(net, NULL, NODE);
    if (server == NULL || client == NULL || co_ssdo_start(server) < 0 || co_csdo_start(client) < 0)
        return 1;
    int up = strcmp(arguments[1], "upload") == 0, transfers = atoi(arguments[2]);
    /* What is read is what was written. The frames of one transfer are counted, which its time leaves out. */
    transfer(net, client, 0);
    counting = 1;
    transfer(net, client, up);
    counting = 0;
    double began = processor_ns();
    for (int number = 0; number < transfers; number++)
        transfer(net, client, up);
    double taken = (processor_ns() - began) / transfers;
    const void *stored = co_dev_get_val(device, 0x1F50, 1);
    if (!done || stored == NULL || co_val_sizeof(CO_DEFTYPE_DOMAIN, stored) != LENGTH
        || memcmp(co_val_addressof(CO_DEFTYPE_DOMAIN, stored), data, LENGTH) != 0) {
        fputs("the node has other bytes\n", stderr);
        return 1;
    }
    printf("%.0f %lu %lu\n", taken, bits, bits_of_data((up ? 0x580 : 0x600) + NODE));
    return 0;
}
