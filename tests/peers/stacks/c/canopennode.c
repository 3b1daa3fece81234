/*
 * A node of CANopenNode for the conformance test, with the objects of its own example (OD.c, DS301_profile.eds):
 * canopennode HOST PORT NODE FILE.eds
 */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "CANopen.h"
#include "CO_storageBlank.h"
#include "OD.h"

#define REMOTE 0x800

void CO_CANsetConfigurationMode(void *module)
{
    (void)module;
}

void CO_CANsetNormalMode(CO_CANmodule_t *module)
{
    module->CANnormal = true;
}

void CO_CANmodule_disable(CO_CANmodule_t *module)
{
    (void)module;
}

CO_ReturnError_t CO_CANmodule_init(CO_CANmodule_t *module, void *bus, CO_CANrx_t *heard, uint16_t heard_count,
                                   CO_CANtx_t *sent, uint16_t sent_count, uint16_t bit_rate)
{
    (void)bit_rate;
    memset(heard, 0, heard_count * sizeof *heard);
    memset(sent, 0, sent_count * sizeof *sent);
    *module = (CO_CANmodule_t){ .CANptr = bus, .rxArray = heard, .rxSize = heard_count, .txArray = sent, .txSize = sent_count };
    return CO_ERROR_NO;
}

CO_ReturnError_t CO_CANrxBufferInit(CO_CANmodule_t *module, uint16_t index, uint16_t ident, uint16_t mask, bool_t remote,
                                    void *object, void (*callback)(void *, void *))
{
    if (module == NULL || object == NULL || callback == NULL || index >= module->rxSize)
        return CO_ERROR_ILLEGAL_ARGUMENT;
    module->rxArray[index] = (CO_CANrx_t){
        .ident = (uint16_t)((ident & 0x7FF) | (remote ? REMOTE : 0)),
        .mask = (uint16_t)((mask & 0x7FF) | REMOTE),
        .object = object,
        .CANrx_callback = callback,
    };
    return CO_ERROR_NO;
}

CO_CANtx_t *CO_CANtxBufferInit(CO_CANmodule_t *module, uint16_t index, uint16_t ident, bool_t remote, uint8_t length,
                               bool_t synchronous)
{
    if (module == NULL || index >= module->txSize)
        return NULL;
    module->txArray[index] = (CO_CANtx_t){ .ident = ident & 0x7FF, .DLC = length, .remote = remote, .syncFlag = synchronous };
    return &module->txArray[index];
}

/* The bus takes each frame at once: none waits. */
CO_ReturnError_t CO_CANsend(CO_CANmodule_t *module, CO_CANtx_t *buffer)
{
    (void)module;
    struct hub_frame frame = { .id = buffer->ident, .remote = (uint8_t)buffer->remote, .length = buffer->DLC };
    memcpy(frame.data, buffer->data, 8);
    hub_send(&frame);
    return CO_ERROR_NO;
}

void CO_CANclearPendingSyncPDOs(CO_CANmodule_t *module)
{
    (void)module;
}

void CO_CANmodule_process(CO_CANmodule_t *module)
{
    (void)module;
}

static void deliver(CO_CANmodule_t *module, struct hub_frame *frame)
{
    uint16_t ident = (uint16_t)(frame->id | (frame->remote ? REMOTE : 0));
    for (CO_CANrx_t *wanted = module->rxArray; wanted < module->rxArray + module->rxSize; wanted++) {
        if (wanted->CANrx_callback != NULL && ((ident ^ wanted->ident) & wanted->mask) == 0) {
            wanted->CANrx_callback(wanted->object, frame);
            return;
        }
    }
}

static bool_t takes_bit_rate(void *object, uint16_t bit_rate)
{
    (void)object;
    return bit_rate == 1000;
}

/* Sets the communication up; ends the program if that fails. */
static void communicate(CO_t *co, uint8_t node)
{
    static uint8_t pending_node;
    static uint16_t pending_bit_rate = 1000;
    pending_node = node;
    uint32_t information = 0;
    CO_LSS_address_t address = { .identity = {
        .vendorID = OD_PERSIST_COMM.x1018_identity.vendor_ID,
        .productCode = OD_PERSIST_COMM.x1018_identity.productCode,
        .revisionNumber = OD_PERSIST_COMM.x1018_identity.revisionNumber,
        .serialNumber = OD_PERSIST_COMM.x1018_identity.serialNumber,
    } };
    co->CANmodule->CANnormal = false;
    /* The example's values, but that the node does not start by itself. */
    if (CO_CANinit(co, co, pending_bit_rate) != CO_ERROR_NO
        || CO_LSSinit(co, &address, &pending_node, &pending_bit_rate) != CO_ERROR_NO
        || CO_CANopenInit(co, NULL, NULL, OD, NULL, CO_NMT_ERR_ON_ERR_REG | CO_ERR_REG_GENERIC_ERR | CO_ERR_REG_COMMUNICATION,
                          500, 1000, 500, false, node, &information) != CO_ERROR_NO
        || CO_CANopenInitPDO(co, co->em, OD, node, &information) != CO_ERROR_NO) {
        fprintf(stderr, "object %X\n", information);
        exit(1);
    }
    CO_LSSslave_initCkBitRateCall(co->LSSslave, NULL, takes_bit_rate);
    CO_CANsetNormalMode(co->CANmodule);
}

int main(int count, char **arguments)
{
    if (count != 5)
        return 2;
    hub_open(arguments[1], arguments[2]);
    uint32_t size = 0, failed = 0;
    CO_t *co = CO_new(NULL, &size);
    CO_storage_t storage = { .enabled = true };
    CO_storage_entry_t stored[] = {
        { .addr = &OD_PERSIST_COMM, .len = sizeof OD_PERSIST_COMM, .subIndexOD = 2, .attr = CO_storage_cmd | CO_storage_restore },
    };
    if (co == NULL
        || CO_storageBlank_init(&storage, co->CANmodule, OD_ENTRY_H1010_storeParameters,
                                OD_ENTRY_H1011_restoreDefaultParameters, stored, 1, &failed) == CO_ERROR_ILLEGAL_ARGUMENT)
        return 1;
    puts("running");
    fflush(stdout);
    CO_NMT_reset_cmd_t reset = CO_RESET_COMM;
    uint64_t last = hub_micros();
    while (reset == CO_RESET_COMM) {
        communicate(co, (uint8_t)atoi(arguments[3]));
        do {
            struct hub_frame frame;
            if (hub_receive(&frame, 1))
                deliver(co->CANmodule, &frame);
            uint64_t now = hub_micros();
            uint32_t passed = (uint32_t)(now - last);
            last = now;
            reset = CO_process(co, false, passed, NULL);
            bool_t synchronised = CO_process_SYNC(co, passed, NULL);
            CO_process_RPDO(co, synchronised, passed, NULL);
            CO_process_TPDO(co, synchronised, passed, NULL);
        } while (reset == CO_RESET_NOT);
    }
    /* Reset node restarts the program, as the processor of a device. */
    execv(arguments[0], arguments);
    return 1;
}
