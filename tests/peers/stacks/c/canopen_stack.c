/*
 * A node of canopen-stack (embedded-office) for the conformance test, with the objects of stack.eds:
 * canopen_stack HOST PORT NODE FILE.eds
 */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "co_core.h"
#include "hub.h"

static uint8_t node_id;
static uint32_t left; /* ticks of 1 ms to the next timer */

static uint32_t device_type = 0, vendor = 0, product = 1, revision = 1, serial = 1, emcy_id = 0x80, sync_id = 0x80;
static uint32_t rpdo_id = 0x200, rpdo_map_1 = CO_LINK(0x2001, 0, 16), rpdo_map_2;
static uint32_t tpdo_id = 0x40000180, tpdo_map_1 = CO_LINK(0x2000, 0, 8), tpdo_map_2;
static uint16_t heartbeat, inhibit, timer, word, measurement = 7;
static uint8_t error_register, rpdo_count = 1, rpdo_type = 255, tpdo_count = 1, tpdo_type = 255, byte = 15, command;
static CO_OBJ_STR name = { 0, (uint8_t *)"A stack under test" };

static CO_OBJ dictionary[] = {
    { CO_KEY(0x1000, 0, CO_OBJ_____R_), CO_TUNSIGNED32, (CO_DATA)&device_type },
    { CO_KEY(0x1001, 0, CO_OBJ_____R_), CO_TUNSIGNED8, (CO_DATA)&error_register },
    { CO_KEY(0x1005, 0, CO_OBJ_____RW), CO_TSYNC_ID, (CO_DATA)&sync_id },
    { CO_KEY(0x1008, 0, CO_OBJ_____R_), CO_TSTRING, (CO_DATA)&name },
    { CO_KEY(0x1014, 0, CO_OBJ__N__R_), CO_TEMCY_ID, (CO_DATA)&emcy_id },
    { CO_KEY(0x1017, 0, CO_OBJ_____RW), CO_THB_PROD, (CO_DATA)&heartbeat },
    { CO_KEY(0x1018, 0, CO_OBJ_D___R_), CO_TUNSIGNED8, (CO_DATA)4 },
    { CO_KEY(0x1018, 1, CO_OBJ_____R_), CO_TUNSIGNED32, (CO_DATA)&vendor },
    { CO_KEY(0x1018, 2, CO_OBJ_____R_), CO_TUNSIGNED32, (CO_DATA)&product },
    { CO_KEY(0x1018, 3, CO_OBJ_____R_), CO_TUNSIGNED32, (CO_DATA)&revision },
    { CO_KEY(0x1018, 4, CO_OBJ_____R_), CO_TUNSIGNED32, (CO_DATA)&serial },
    { CO_KEY(0x1200, 0, CO_OBJ_D___R_), CO_TUNSIGNED8, (CO_DATA)2 },
    { CO_KEY(0x1200, 1, CO_OBJ_DN__R_), CO_TSDO_ID, (CO_DATA)CO_COBID_SDO_REQUEST() },
    { CO_KEY(0x1200, 2, CO_OBJ_DN__R_), CO_TSDO_ID, (CO_DATA)CO_COBID_SDO_RESPONSE() },
    { CO_KEY(0x1400, 0, CO_OBJ_D___R_), CO_TUNSIGNED8, (CO_DATA)2 },
    { CO_KEY(0x1400, 1, CO_OBJ__N__RW), CO_TPDO_ID, (CO_DATA)&rpdo_id },
    { CO_KEY(0x1400, 2, CO_OBJ_____RW), CO_TPDO_TYPE, (CO_DATA)&rpdo_type },
    { CO_KEY(0x1600, 0, CO_OBJ_____RW), CO_TPDO_NUM, (CO_DATA)&rpdo_count },
    { CO_KEY(0x1600, 1, CO_OBJ_____RW), CO_TPDO_MAP, (CO_DATA)&rpdo_map_1 },
    { CO_KEY(0x1600, 2, CO_OBJ_____RW), CO_TPDO_MAP, (CO_DATA)&rpdo_map_2 },
    { CO_KEY(0x1800, 0, CO_OBJ_D___R_), CO_TUNSIGNED8, (CO_DATA)5 },
    { CO_KEY(0x1800, 1, CO_OBJ__N__RW), CO_TPDO_ID, (CO_DATA)&tpdo_id },
    { CO_KEY(0x1800, 2, CO_OBJ_____RW), CO_TPDO_TYPE, (CO_DATA)&tpdo_type },
    { CO_KEY(0x1800, 3, CO_OBJ_____RW), CO_TUNSIGNED16, (CO_DATA)&inhibit },
    { CO_KEY(0x1800, 5, CO_OBJ_____RW), CO_TPDO_EVENT, (CO_DATA)&timer },
    { CO_KEY(0x1A00, 0, CO_OBJ_____RW), CO_TPDO_NUM, (CO_DATA)&tpdo_count },
    { CO_KEY(0x1A00, 1, CO_OBJ_____RW), CO_TPDO_MAP, (CO_DATA)&tpdo_map_1 },
    { CO_KEY(0x1A00, 2, CO_OBJ_____RW), CO_TPDO_MAP, (CO_DATA)&tpdo_map_2 },
    { CO_KEY(0x2000, 0, CO_OBJ___APRW), CO_TUNSIGNED8, (CO_DATA)&byte },
    { CO_KEY(0x2001, 0, CO_OBJ____PRW), CO_TUNSIGNED16, (CO_DATA)&word },
    { CO_KEY(0x2002, 0, CO_OBJ______W), CO_TUNSIGNED8, (CO_DATA)&command },
    { CO_KEY(0x2003, 0, CO_OBJ____PR_), CO_TUNSIGNED16, (CO_DATA)&measurement },
    CO_OBJ_DICT_ENDMARK,
};

static void nothing(void) {}
static void enable(uint32_t baudrate) { (void)baudrate; }
static void init_timer(uint32_t frequency) { (void)frequency; left = 0; }
static void reload(uint32_t ticks) { left = ticks; }
static uint32_t delay(void) { return left; }
static void stop(void) { left = 0; }
static uint8_t update(void) { return left > 0 && --left == 0; }

static int16_t receive(CO_IF_FRM *frame)
{
    struct hub_frame heard;
    /* The stack's frames have no bit for a remote frame. */
    if (!hub_receive(&heard, 1) || heard.remote)
        return 0;
    frame->Identifier = heard.id;
    frame->DLC = heard.length;
    memcpy(frame->Data, heard.data, 8);
    return 1;
}

static int16_t transmit(CO_IF_FRM *frame)
{
    struct hub_frame sent = { .id = (uint16_t)frame->Identifier, .length = frame->DLC };
    memcpy(sent.data, frame->Data, 8);
    hub_send(&sent);
    return sizeof *frame;
}

/* A memory that keeps nothing: there is no object that stores. */
static uint32_t memory_read(uint32_t at, uint8_t *data, uint32_t size)
{
    (void)at;
    memset(data, 0, size);
    return size;
}

static uint32_t memory_write(uint32_t at, uint8_t *data, uint32_t size)
{
    (void)at;
    (void)data;
    return size;
}

static const CO_IF_CAN_DRV can = { nothing, enable, receive, transmit, nothing, nothing };
static const CO_IF_TIMER_DRV ticks = { init_timer, reload, delay, stop, nothing, update };
static const CO_IF_NVM_DRV memory = { nothing, memory_read, memory_write };
static CO_IF_DRV drivers = { &can, &ticks, &memory };
static CO_TMR_MEM timers[16];
static uint8_t transfers[CO_SSDO_N * CO_SDO_BUF_BYTE];
static CO_EMCY_TBL errors[] = { { CO_EMCY_REG_GENERAL, CO_EMCY_CODE_GEN_ERR } };

int main(int count, char **given)
{
    if (count != 5)
        return 2;
    node_id = (uint8_t)atoi(given[3]);
    hub_open(given[1], given[2]);
    CO_NODE_SPEC specification = {
        node_id, 1000000, dictionary, sizeof dictionary / sizeof *dictionary, errors, timers, 16, 1000, &drivers, transfers,
    };
    static CO_NODE node;
    CONodeInit(&node, &specification);
    if (CONodeGetErr(&node) != CO_ERR_NONE)
        return 1;
    puts("running");
    fflush(stdout);
    CONodeStart(&node);
    uint64_t tick = hub_micros();
    for (;;) {
        CONodeProcess(&node);
        for (; hub_micros() >= tick; tick += 1000)
            COTmrService(&node.Tmr);
        COTmrProcess(&node.Tmr);
    }
}
